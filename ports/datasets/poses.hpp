// Parsers of trajectory, time and calibration text files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "ports/datasets/stamps.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::datasets {

/// A pose file. `stamps_ns` is as long as `poses`, or empty where the format has no stamps.
struct Trajectory {
  std::vector<Pose> poses;              ///< in the frames of the file
  std::vector<std::int64_t> stamps_ns;  ///< as long as `poses`, or empty
  std::size_t not_finite = 0;           ///< lines with a stamp but no pose, left out
};

/// Parses one pose per line, told apart by the number of columns: 8 = TUM (`t x y z qx qy qz qw`),
/// 12 = KITTI (3x4 by rows), 16 = 4x4 by rows, 13 and 17 = a matrix behind a stamp; or as a header
/// (also a comment right before the poses) names them; or 4x4 matrices over four lines. Stamps are
/// in `unit`. Columns are separated by blanks, tabs, commas or semicolons; `#` starts a comment,
/// so do `//` and `%` with a blank at the begin of a line.
/// A line with a stamp whose pose is not finite or empty is left out. Any other pose must be finite
/// and rigid; rotations that are so only within their printed digits are made exact. `file` names
/// the text in errors. Throws DatasetError with the line and with what is accepted.
Trajectory parse_trajectory(std::string_view text, const std::filesystem::path& file,
                            StampUnit unit = StampUnit::kAuto);

/// Parses one time per line into nanoseconds: seconds (KITTI's times.txt), without going through
/// floating point where the number is written out plainly; whole counts of a smaller unit; or
/// `YYYY-MM-DD hh:mm:ss.fraction` (KITTI raw). Throws DatasetError.
std::vector<std::int64_t> parse_times(std::string_view text, const std::filesystem::path& file);

/// The line `Tr: <12 values>` of KITTI's calib.txt: T_camera_lidar. Empty if there is no such
/// line. Throws DatasetError.
std::optional<Pose> parse_calibration(std::string_view text, const std::filesystem::path& file);

/// Pose of a unit quaternion, which may be off by the digits it was printed with. Empty if its
/// length is not about one or anything is not finite.
std::optional<Pose> pose_from_quaternion(double x, double y, double z, double qx, double qy,
                                         double qz, double qw);

}  // namespace unimapper::datasets
