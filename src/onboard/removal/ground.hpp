// Ground segmentation
#pragma once

#include "src/onboard/keyframe/cell_table.hpp"
#include "src/onboard/keyframe/coarse_voxels.hpp"
#include "src/onboard/slice.hpp"
#include "stray_returns.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// Marks the ground voxels G (paper section IV-B, equation 4): planes within theta_A of up,
/// except those with points below them and those seen from below: `sensor_m` is where the sensor
/// was, metres from the grid's origin. Returns how many there are. O(voxels).
std::uint32_t find_ground(float voxel_size_m, const Eigen::Vector3f& sensor_m,
                          FixedHashMap<CoarseVoxel>& voxels) noexcept;

/// Gives every voxel in G and every neighbour of G (the candidates C) the plane that splits its
/// points (paper section IV-B, equation 5). O(voxels).
void propagate_ground(const GroundConfig& config, FixedHashMap<CoarseVoxel>& voxels) noexcept;

/// Height above the voxel's splitting plane, metres.
[[nodiscard]] inline float height_above_ground(const CoarseVoxel& voxel,
                                               const Eigen::Vector3f& p) noexcept {
  return voxel.ground_normal.dot(p - voxel.ground_point);
}

/// Marks every cell of some blocks as ground or candidate, or neither, and candidates that connect
/// nothing as followers. O(cells).
void split_ground(const GroundConfig& ground, const RemovalConfig& removal,
                  const CoarseVoxels& voxels, const StrayReturns& stray, Slice some,
                  CellTable& cells) noexcept;

/// A height in a cell, in 1/256 of its edge, that no point of it reaches.
inline constexpr std::uint32_t kAboveCell = 256;

/// How high in a cell (0 to `kAboveCell`) its points stop being ground.
[[nodiscard]] std::uint32_t ground_level_in_cell(const GroundConfig& config,
                                                 const CoarseVoxels& voxels, const CellTable& cells,
                                                 std::uint32_t row) noexcept;

/// How high in a cell (0 to `kAboveCell`) points reach `height_m` above the plane that splits its
/// voxel.
[[nodiscard]] std::uint32_t level_in_cell_above(const CoarseVoxel& voxel, float height_m,
                                                const CellTable& cells, std::uint32_t row) noexcept;

}  // namespace unimapper::onboard
