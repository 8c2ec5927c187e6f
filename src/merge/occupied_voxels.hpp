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

/// Edge of a voxel of the map frame in which observations of different keyframes coincide: that of
/// the robot's fine cells, metres.
inline constexpr float kObservedVoxelM = 0.2F;

/// The voxel of a point, or nothing if it is too far away to have one.
[[nodiscard]] std::optional<VoxelKey> observed_voxel(const Eigen::Vector3d& point);

/// Voxels that the cells of one session occupy, static and dynamic alike.
class OccupiedVoxels {
 public:
  /// O(cells).
  explicit OccupiedVoxels(const PlacedSession& placed);

  /// Keyframes that observed the voxel as occupied, ascending.
  [[nodiscard]] std::span<const std::uint32_t> keyframes_at(VoxelKey voxel) const;

 private:
  void add(VoxelKey voxel, std::uint32_t keyframe);

  VoxelTable table_;
  std::vector<std::vector<std::uint32_t>> keyframes_;  ///< by number in the table
};

}  // namespace unimapper::merge
