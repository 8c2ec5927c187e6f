// Labels of points by the refined labels of their cells.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "src/core/voxel_key.hpp"
#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/merge/refinement.hpp"

namespace unimapper::apps {

/// Finds the cell that a point went into, by the grid of the odometry. Ground cells hold the feet
/// of who stands on them, too: below dynamic cells, points above the level of the ground around are
/// dynamic.
class CellLabels {
 public:
  /// O(n log n) in the cells.
  CellLabels(const KeyframeRecord& keyframe, const merge::RefinedKeyframe& refined);

  /// Whether a point in the levelled keyframe frame, metres, belongs to something that moved.
  [[nodiscard]] bool is_dynamic(const Eigen::Vector3f& point) const;

 private:
  struct Entry {
    VoxelKey bin;
    VoxelKey voxel;
    Eigen::Vector3f position;
    bool dynamic;
    bool ground;
    float dynamic_above_m;  ///< height in the keyframe's frame from which its points are dynamic
  };
  struct Hash {
    std::size_t operator()(VoxelKey key) const { return mix_bits(key); }
  };
  /// Voxel of the odometry's grid, counted from the keyframe's; none where it is too far away.
  [[nodiscard]] std::optional<VoxelIndex> voxel_of(const Eigen::Vector3f& point) const;
  [[nodiscard]] static VoxelIndex bin_of(const VoxelIndex& voxel);
  /// Calls `visit(entry)` for those in the bins around a point that are no farther from it
  /// horizontally than a bin.
  template <typename Visit>
  void visit_around(const Eigen::Vector3f& point, const Visit& visit) const;
  [[nodiscard]] bool is_below_dynamic(const Entry& ground) const;
  void separate_feet();

  Pose T_odometry_keyframe_;
  float cell_size_m_;
  float bin_m_;
  std::vector<Entry> entries_;                               ///< sorted by bin
  std::unordered_map<VoxelKey, std::uint32_t, Hash> first_;  ///< entry of a bin
};

}  // namespace unimapper::apps
