// Nearest-neighbour search with one kd-tree per coarse voxel (paper section VI, end).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

namespace unimapper::merge {

/// A cloud split into coarse voxels with one kd-tree each: a search costs O(log n) of the points
/// near by, however large the map is.
class VoxelTrees {
 public:
  VoxelTrees(const std::vector<Eigen::Vector3f>& points, float voxel_size_m);
  ~VoxelTrees();
  VoxelTrees(VoxelTrees&&) noexcept;

  /// True if a point lies within `distance_m`, which must not exceed the voxel size. All voxels
  /// that a ball of this radius touches are searched, so neighbours beyond a voxel's face are
  /// found.
  [[nodiscard]] bool has_neighbor(const Eigen::Vector3f& point, float distance_m) const;
  /// Of memory, about.
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  struct Trees;
  std::unique_ptr<Trees> trees_;
};

}  // namespace unimapper::merge
