// Parsers of KITTI raw's text files.
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "unimapper/core/pose.hpp"

namespace unimapper::datasets {

/// A packet of KITTI's GPS and IMU, as far as it is a pose.
struct Oxts {
  /// North of the equator.
  double latitude_deg;
  /// East of Greenwich.
  double longitude_deg;
  /// Above the ellipsoid.
  double altitude_m;
  /// About the forward axis; 0: level.
  double roll_rad;
  /// About the left axis; 0: level.
  double pitch_rad;
  double yaw_rad;  ///< 0: east, counterclockwise
};

/// Parses oxts/data/*.txt. Throws DatasetError.
[[nodiscard]] Oxts parse_oxts(std::string_view text, const std::filesystem::path& file);

/// T_world_imu in Mercator's projection, x east, y north, as KITTI's development kit computes it;
/// `scale` is the cosine of the drive's first latitude.
[[nodiscard]] Pose mercator_pose(const Oxts& oxts, double scale);

/// T_velodyne_imu of calib_imu_to_velo.txt (`R:` 9 values, `T:` 3 values); empty where the lines
/// are missing or no rigid transform. Throws DatasetError for what is no number.
[[nodiscard]] std::optional<Pose> parse_raw_calibration(std::string_view text,
                                                        const std::filesystem::path& file);

}  // namespace unimapper::datasets
