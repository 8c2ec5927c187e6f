// Keyframes of a session by the map voxels they occupy
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "unimapper/merge/refinement.hpp"
#include "voxel_table.hpp"

namespace unimapper::merge {

/// The voxel of a point, or nothing if it is too far away to have one.
[[nodiscard]] std::optional<VoxelKey> observed_voxel(const Eigen::Vector3d& point, float size_m);

/// Voxels that the cells of one session occupy, static and dynamic alike.
class OccupiedVoxels {
 public:
  /// O(cells).
  OccupiedVoxels(const PosedSession& posed, float size_m);

  /// Keyframes that observed the voxel as occupied, ascending.
  [[nodiscard]] std::span<const std::uint32_t> keyframes_at(VoxelKey voxel) const;

 private:
  void add(VoxelKey voxel, std::uint32_t keyframe);

  VoxelTable table_;
  std::vector<std::vector<std::uint32_t>> keyframes_;  ///< by number in the table
};

}  // namespace unimapper::merge
