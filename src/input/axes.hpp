// Axes of the points: which of them the sensor turns about, or looks along
#pragma once

#include <array>
#include <span>

#include "ports/datasets/dataset.hpp"
#include "src/input/finding.hpp"
#include "src/input/stamps.hpp"

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
  double middle_deg = 0.0;  ///< middle of the azimuths that hold 98 % of the points, degrees
  std::size_t points = 0;   ///< looked at
};

/// Measures scans, at most a few thousand points of each.
[[nodiscard]] DirectionFigures measure_directions(std::span<const datasets::Scan> scans);

/// On which side of the sensor lies what it is driven on.
struct DrivenSurface {
  std::size_t below = 0;  ///< metres of path, over all scans, with points below the sensor's path
  /// Metres of path, over all scans, with points above the sensor's path, at a height near to that
  /// of most of them. They are ceilings, or ground where the sensor is upside down.
  std::size_t above = 0;
};

/// Counts metres of path within 25 m of the scans `indices`, at most 20 scans before them and
/// 100 after, that have points 0.3 to 2.5 m above the path, or 0.08 to 5 m below it, along the
/// odometry's z axis: what is below speaks for a right one, also of low robots and of trucks.
/// Only where rays as low as `lowest_deg` are 1.5 m and more below the sensor: nearer, the ground
/// is out of sight.
[[nodiscard]] DrivenSurface measure_driven_surface(const Track& track, double lowest_deg,
                                                   std::span<const std::size_t> indices,
                                                   std::span<const datasets::Scan* const> scans);

/// Whether it lies above along 20 m and more, and hardly below.
[[nodiscard]] bool is_upside_down(const DrivenSurface& driven);

/// Whether most of the poses have their z axis down.
[[nodiscard]] bool are_upside_down(const Track& track, std::span<const std::size_t> indices);

/// Points whose z axis is not up: a sensor that turns about x or y, looks along z, or hangs upside
/// down. Where it is `turned_by_poses`, these are wrong, and not the points.
[[nodiscard]] Finding check_axes(const DirectionFigures& directions, const DrivenSurface& driven,
                                 bool turned_by_poses = false);

}  // namespace unimapper::input
