// Messages of a simulated robot's drivers: raw sweeps, and an odometry between them.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "geometry.hpp"

namespace unimapper::simulator {

/// A return in the points' frame at the time of its shot.
struct RawPoint {
  float x, y, z;
  float intensity;     ///< 0..1
  std::uint16_t ring;  ///< as the sensor's driver numbers its lasers
  float time_s;        ///< after the sweep's stamp, which is its end: -0.1..0
};

/// Where the points' frame is at a time.
struct OdometrySample {
  std::int64_t stamp_ns;
  Frame T_odometry_points;  ///< drifting; that of poses.txt at the scans' stamps
  Frame T_world_points;     ///< the truth
};

/// A sweep, and the odometry since the sweep before, its last sample at this sweep's stamp.
struct DriveStep {
  std::uint32_t scan;
  std::int64_t stamp_ns;
  std::vector<RawPoint> points;  ///< as many as, and in the order of, the scan's file
  std::vector<OdometrySample> odometry;
};

/// Called for every scan, in their order, from one thread at a time.
using DriveObserver = std::function<void(const DriveStep&)>;

/// Odometry between the scans for which it is known.
class ContinuousOdometry {
 public:
  ContinuousOdometry() = default;
  /// True and estimated poses of scans that are `interval_s` apart, the first at `interval_s`.
  ContinuousOdometry(std::vector<Frame> truth, std::vector<Frame> odometry, double interval_s);

  /// Pose at a time, 0 to the last scan, where the true one is `truth`: the error that came up
  /// since the scan before is spread evenly over the time.
  [[nodiscard]] Frame at(double time_s, const Frame& truth) const;

 private:
  std::vector<Frame> truth_;
  std::vector<Frame> odometry_;
  double interval_s_ = 1.0;
};

}  // namespace unimapper::simulator
