// Common view of two keyframes and repeatability of their keypoints, from true poses.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "unimapper/core/keyframe.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::bench {

/// Occupied voxels of 1 m of what is not ground, ascending.
using ViewVoxels = std::vector<std::uint64_t>;

[[nodiscard]] ViewVoxels view_voxels(std::span<const FineCell> cells, const Pose& T_world_keyframe);

/// Share of the smaller one's voxels that both have, [0, 1]; 0 if one has none. O(voxels).
[[nodiscard]] double common_view(const ViewVoxels& a, const ViewVoxels& b);

/// Vertical columns of the world that hold anything but ground.
class OccupiedColumns {
 public:
  OccupiedColumns() = default;
  OccupiedColumns(std::span<const FineCell> cells, const Pose& T_world_keyframe, double size_m);
  /// Whether the column of a point or an adjacent one is occupied.
  [[nodiscard]] bool near(const Eigen::Vector3d& world_point) const;
  /// The middle of every column, in the world.
  [[nodiscard]] std::vector<Eigen::Vector2d> centers() const;

 private:
  double size_m_ = 1.0;
  std::vector<std::uint64_t> columns_;  // ascending
};

/// Keypoints of a keyframe in the world, and its occupied columns.
struct KeypointView {
  std::span<const Eigen::Vector3d> keypoints;
  const OccupiedColumns& occupied;
};

/// Share of keypoints that the other keyframe has within `radius_m` (horizontally), among those in
/// its occupied columns; both directions together, NaN if there are none.
[[nodiscard]] double repeatability(const KeypointView& a, const KeypointView& b, double radius_m);

}  // namespace unimapper::bench
