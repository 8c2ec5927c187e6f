// Stamps and poses of a recording, against each other
#pragma once

#include <cstdint>
#include <functional>

#include "src/input/finding.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::input {

/// Poses and stamps of a recording by index.
struct Track {
  std::size_t size = 0;                               ///< scans
  std::function<Pose(std::size_t)> pose;              ///< T_odometry_sensor
  std::function<std::int64_t(std::size_t)> stamp_ns;  ///< of the scan
};

/// What poses and stamps say of the motion.
struct MotionFigures {
  std::size_t scans = 0;
  double interval_s = 0.0;         ///< median, from stamp to stamp
  double longest_gap_s = 0.0;      ///< largest interval
  std::size_t gaps = 0;            ///< intervals above three medians
  std::size_t reversed = 0;        ///< stamps before the one before
  std::size_t repeated = 0;        ///< stamps equal to the one before
  double duration_s = 0.0;         ///< first to last stamp
  double path_m = 0.0;             ///< length
  double step_m = 0.0;             ///< median, from scan to scan
  double speed_mps = 0.0;          ///< median
  double acceleration_mps2 = 0.0;  ///< median
  std::size_t jumps = 0;           ///< steps of more than 10 m that are faster than 60 m/s
  double rounding_m = 0.0;         ///< steps of far positions in single precision; 0: they are not
  double from_earth_m = 0.0;       ///< centre, of the first pose at sea level or near; else 0
  double climb = 0.0;              ///< share of the path along the odometry's z axis
};

/// Whether the step from scan `i` to the next is one of `MotionFigures::jumps`.
[[nodiscard]] bool is_jump(const Track& track, std::size_t i);

/// Measures a track. O(scans).
[[nodiscard]] MotionFigures measure_motion(const Track& track);

/// Stamps that do not increase.
[[nodiscard]] Finding check_stamp_order(const MotionFigures& motion);

/// Intervals that no LiDAR has: stamps in another unit.
[[nodiscard]] Finding check_interval(const MotionFigures& motion);

/// Scans too far apart to see the same place often enough for removal: those of keyframes only.
[[nodiscard]] Finding check_spacing(const MotionFigures& motion);

/// Far positions that were rounded to 32-bit floats or to few digits.
[[nodiscard]] Finding check_rounding(const MotionFigures& motion);

/// Earth-centred positions (ECEF), whose z axis is not up.
[[nodiscard]] Finding check_frame(const MotionFigures& motion);

/// Speeds, accelerations and jumps that no robot has.
[[nodiscard]] Finding check_speed(const MotionFigures& motion);

}  // namespace unimapper::input
