// What a keyframe shows, in the world where the truth puts it.
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

/// Upright columns of the world with anything in them that is not ground.
class SeenColumns {
 public:
  SeenColumns() = default;
  SeenColumns(std::span<const FineCell> cells, const Pose& T_world_keyframe, double size_m);
  /// Whether the column of a point, or one beside it, holds anything.
  [[nodiscard]] bool near(const Eigen::Vector3d& world_point) const;
  /// The middle of every column, in the world.
  [[nodiscard]] std::vector<Eigen::Vector2d> centers() const;

 private:
  double size_m_ = 1.0;
  std::vector<std::uint64_t> columns_;  // ascending
};

/// One keyframe's keypoints in the world, and where it saw anything.
struct KeypointView {
  std::span<const Eigen::Vector3d> keypoints;
  const SeenColumns& seen;
};

/// Share of keypoints that the other one has as well within `radius_m` (horizontally), of those
/// where the other one sees anything; both directions together, NaN if there are none.
[[nodiscard]] double repeatability(const KeypointView& a, const KeypointView& b, double radius_m);

}  // namespace unimapper::bench
