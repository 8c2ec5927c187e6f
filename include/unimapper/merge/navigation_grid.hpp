// Two-dimensional occupancy grid of the ground that can be driven
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "unimapper/merge/merger.hpp"

namespace unimapper::merge {

/// What a robot may drive over.
struct GridOptions {
  double resolution_m = 0.2;  ///< edge of a cell
  double obstacle_m = 0.25;   ///< what stands less high above the ground is no obstacle
  double clearance_m = 2.0;   ///< what begins at least so high above the ground is no obstacle
};

/// What is known of a cell.
enum class GridCell : std::uint8_t {
  kUnknown,   ///< no ground was seen
  kFree,      ///< ground without anything on it
  kOccupied,  ///< something stands there
};

/// Occupancy of the ground that is reached from the sessions' ways without a step, seen from above.
struct NavigationGrid {
  double resolution_m = 0.0;       ///< edge of a cell
  Eigen::Vector2d origin;          ///< lower left corner of the lower left cell, map frame, metres
  std::uint32_t width = 0;         ///< cells along x
  std::uint32_t height = 0;        ///< cells along y
  std::vector<GridCell> cells;     ///< row by row, from the lowest y
  std::size_t several_levels = 0;  ///< cells that are reached on another storey, too; only the
                                   ///< level that was reached first is in the grid

  /// The cell in a column, from the lowest x, and a row, from the lowest y.
  [[nodiscard]] GridCell at(std::uint32_t x, std::uint32_t y) const {
    return cells[static_cast<std::size_t>(y) * width + x];
  }
};

/// The grid of the sessions that are in the map, from their static cells after refinement. Ground
/// is followed outward from below the sensors: neighbours may differ by a slope of one half and 0.1
/// m, gaps of 0.6 m are crossed. Throws std::runtime_error for more than 2^28 cells. O(cells of the
/// keyframes + cells of the grid).
[[nodiscard]] NavigationGrid navigation_grid(const std::vector<SessionData>& sessions,
                                             const MergeResult& result,
                                             const GridOptions& options = {});

}  // namespace unimapper::merge
