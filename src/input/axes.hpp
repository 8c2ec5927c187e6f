// Axes of the points: which of them the sensor turns about, or looks along
#pragma once

#include <array>
#include <span>

#include "ports/datasets/dataset.hpp"
#include "src/input/finding.hpp"

namespace unimapper::input {

/// Directions of the points of some scans.
struct DirectionFigures {
  /// Of the twelve sectors about the x, y and z axis, how many hold points of their share.
  std::array<int, 3> sectors{};
  /// Elevations about each axis, degrees: 1 % and 99 % of the points.
  std::array<double, 3> lowest_deg{};
  std::array<double, 3> highest_deg{};
  /// Mean direction; near 0 where the sensor sees all round.
  std::array<double, 3> mean{};
  /// Azimuths about z that hold 98 % of the points, degrees, up to 360; 0 is ahead (x).
  double width_deg = 0.0;
  double middle_deg = 0.0;  ///< of them
  std::size_t points = 0;   ///< looked at
};

/// Measures scans, at most a few thousand points of each.
[[nodiscard]] DirectionFigures measure_directions(std::span<const datasets::Scan> scans);

/// Points whose z axis is not up: a sensor that turns about x or y, or looks along z. `level_above`
/// and `level_below`: surface points that face z, above and below the sensor.
[[nodiscard]] Finding check_axes(const DirectionFigures& directions, std::size_t level_above,
                                 std::size_t level_below);

}  // namespace unimapper::input
