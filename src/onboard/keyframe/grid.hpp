// Grid of a keyframe
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "src/core/voxel_key.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// Cells of a keyframe are counted from an origin near the sensor, so that single precision
/// suffices however far the odometry has travelled. Origins lie on a lattice that is a whole
/// number of coarse voxels and of 4 x 4 x 4 blocks: cells, voxels and blocks of different
/// keyframes coincide, and going from one to the other is an integer addition.
struct Grid {
  float cell_size_m = 0.2F;
  std::int32_t cells_per_voxel = 10;
  std::int64_t lattice_x = 0;  ///< origin, in lattice steps from the odometry origin
  std::int64_t lattice_y = 0;
  std::int64_t lattice_z = 0;

  /// Edge of a coarse voxel.
  [[nodiscard]] float voxel_size_m() const noexcept {
    return cell_size_m * static_cast<float>(cells_per_voxel);
  }
  /// Cells of one lattice step.
  [[nodiscard]] std::int32_t step_cells() const noexcept { return cells_per_voxel * 4; }
  [[nodiscard]] double step_m() const noexcept {
    return static_cast<double>(cell_size_m) * step_cells();
  }
  /// The origin in odometry coordinates, metres.
  [[nodiscard]] Eigen::Vector3d origin_m() const noexcept {
    return Eigen::Vector3d(static_cast<double>(lattice_x), static_cast<double>(lattice_y),
                           static_cast<double>(lattice_z)) *
           step_m();
  }
};

/// A grid whose origin is next to `position_m`, whose coordinates are below 1e9 metres.
[[nodiscard]] inline Grid grid_near(const Eigen::Vector3d& position_m,
                                    const VoxelConfig& config) noexcept {
  Grid grid;
  grid.cell_size_m = config.fine_size_m;
  grid.cells_per_voxel = config.cells_per_voxel();
  const auto steps = [&grid](double coordinate) {
    return floor_to<std::int64_t>(coordinate / grid.step_m());
  };
  grid.lattice_x = steps(position_m.x());
  grid.lattice_y = steps(position_m.y());
  grid.lattice_z = steps(position_m.z());
  return grid;
}

/// What to add to a cell's index in `from` to get the same cell's index in `to`.
struct GridShift {
  bool representable = false;  ///< false: too far apart to have any cell in common
  VoxelIndex cells;
};

[[nodiscard]] inline GridShift shift_between(const Grid& from, const Grid& to) noexcept {
  const std::int64_t steps[3] = {from.lattice_x - to.lattice_x, from.lattice_y - to.lattice_y,
                                 from.lattice_z - to.lattice_z};
  // Sums of a shift and an index must not leave their 21 bits.
  const std::int64_t limit = (kVoxelAxisLimit / 4) / from.step_cells();
  for (const std::int64_t step : steps) {
    if (step > limit || step < -limit) return {};
  }
  const auto cells = [&from](std::int64_t step) {
    return static_cast<std::int32_t>(step) * from.step_cells();
  };
  return {true, {cells(steps[0]), cells(steps[1]), cells(steps[2])}};
}

}  // namespace unimapper::onboard
