// Ranges of a few scans: units of the points, and points that are none
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "ports/datasets/dataset.hpp"
#include "src/input/finding.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::input {

/// Ranges of the points of some scans.
struct RangeFigures {
  double median_m = 0.0;        ///< of the finite points away from the origin
  double largest_m = 0.0;       ///< 99 % of them lie within
  double center_m = 0.0;        ///< distance of the points' median from the origin
  double scatter_m = 0.0;       ///< 90 % of the points lie within of that median
  double not_finite = 0.0;      ///< share of all points that is NaN or infinite
  double at_origin = 0.0;       ///< share of all points within a centimetre of the origin
  double implausible = 0.0;     ///< share of the finite with a coordinate no LiDAR measures
  std::uint64_t points = 0;     ///< of all scans
  std::size_t empty_scans = 0;  ///< without a finite point away from the origin
  std::size_t scans = 0;        ///< looked at
};

/// Measures scans. O(points).
[[nodiscard]] RangeFigures range_figures(std::span<const datasets::Scan> scans);

/// Points in millimetres, centimetres or kilometres.
[[nodiscard]] Finding check_units(const RangeFigures& ranges);

/// Points whose coordinates are those of a map, far from the sensor.
[[nodiscard]] Finding check_origin(const RangeFigures& ranges);

/// Scans without points, or with many that are not finite or are all zero.
[[nodiscard]] Finding check_points(const RangeFigures& ranges);

/// Records of another size than they were read with: what was read as x, y, z is something else.
/// `scans` as read, four floats each.
[[nodiscard]] Finding check_records(std::span<const datasets::Scan> scans,
                                    const RangeFigures& ranges);

/// Tells scans that a driver repeats: bit by bit those before them, though the robot moved by 0.1 m
/// or a degree since the first of them. One that stands may see the very same.
class RepeatedScans {
 public:
  /// Whether the next scan is such a one; `fingerprint` as in `datasets::Scan`. O(1).
  bool add(std::uint64_t fingerprint, const Pose& pose);

 private:
  std::uint64_t fingerprint_ = 0;  // of the scan before
  Pose first_;                     // of those in a row that are alike
};

/// Scans that repeat the one before point by point; `scans` come in pairs of neighbours.
[[nodiscard]] Finding check_repeated(std::span<const datasets::Scan* const> first,
                                     std::span<const datasets::Scan* const> second);

}  // namespace unimapper::input
