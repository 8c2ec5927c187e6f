// Axes of the points: which of them the sensor turns about, or looks along
#pragma once

#include <array>
#include <cstdint>
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

/// What lies on one side of the sensor's path, within half a metre of it.
struct SurfaceSide {
  std::size_t seen = 0;            ///< metres of path, over all scans, with points there
  std::size_t flat = 0;            ///< seen metres with a level surface
  std::size_t level = 0;           ///< flat metres about as far away as usual
  std::size_t in_sight = 0;        ///< metres about as far away, in sight, flat or not
  std::size_t level_in_sight = 0;  ///< level metres where ground below would be in sight
  double height_m = 0.0;           ///< median distance from the path
  double scatter_m = 0.0;          ///< seven in ten metres differ by less from it
  double farthest_m = 0.0;         ///< what nine in ten metres are nearer than
  std::size_t in_way = 0;          ///< seen metres with things that stand out half as far
};

/// Which of both sides of the sensor's path is driven on.
struct DrivenSurface {
  SurfaceSide below;
  SurfaceSide above;  ///< ceilings, or ground where the sensor is upside down
};

/// Looks at the path that lies ahead of the scans `indices`, within 25 m and 100 scans, for points
/// 0.08 to 8 m above and below it, along the odometry's z axis. Ground below is in sight where rays
/// as low as `lowest_deg` are 1 m and more below the sensor.
[[nodiscard]] DrivenSurface measure_driven_surface(const Track& track, double lowest_deg,
                                                   std::span<const std::size_t> indices,
                                                   std::span<const datasets::Scan* const> scans);

/// What the elevations of the points are like, against data sheets.
enum class SheetSide : std::uint8_t {
  kUnknown,   ///< both, or neither
  kUpright,   ///< a known LiDAR, and no known one that is upside down
  kMirrored,  ///< a known LiDAR that is upside down, and no upright one
};

/// Where up is, along the odometry's z axis.
enum class Side : std::uint8_t { kAbove, kBelow, kUnknown };

/// Below, where a level surface lies above along 20 m and more, and hardly one below. Unknown where
/// surfaces lie on both sides, as under a ceiling, and the one above is more like what is driven
/// on: things stand on it in the robot's way, or it is nearer, or equally far all along the path.
/// Unknown as well where data sheets alone say that the sensor is upside down: it may have been
/// turned over already.
[[nodiscard]] Side find_up(const DrivenSurface& driven, SheetSide sheet);

/// Whether most of the poses have their z axis down.
[[nodiscard]] bool are_upside_down(const Track& track, std::span<const std::size_t> indices);

/// Points whose z axis is not up: a sensor that turns about x or y, looks along z, or hangs upside
/// down. Where it is `turned_by_poses`, these are wrong, and not the points.
[[nodiscard]] Finding check_axes(const DirectionFigures& directions, const DrivenSurface& driven,
                                 SheetSide sheet, bool turned_by_poses = false);

}  // namespace unimapper::input
