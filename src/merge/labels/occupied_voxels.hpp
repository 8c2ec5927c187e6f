// Voxels of the map that keyframes occupy, as blocks
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "src/core/voxel_key.hpp"
#include "src/merge/voxel_table.hpp"
#include "unimapper/core/keyframe_record.hpp"

namespace unimapper::merge {

/// The voxel of a point, or nothing if it is too far away to have one.
[[nodiscard]] std::optional<VoxelKey> observed_voxel(const Eigen::Vector3d& point, float size_m);

/// Voxels that the cells of one keyframe occupy, static and dynamic alike: the blocks they lie in,
/// by their keys, ascending, and one bit per voxel.
class OccupiedBlocks {
 public:
  struct Block {
    VoxelKey key;
    std::uint64_t voxels;
  };
  /// Voxels of `size_m` in the map frame. O(cells + blocks log blocks).
  OccupiedBlocks(const KeyframeRecord& keyframe, const Pose& T_map_keyframe, float size_m);

  [[nodiscard]] const std::vector<Block>& blocks() const { return blocks_; }

 private:
  std::vector<Block> blocks_;
};

/// How many of some keyframes occupy each voxel that one of them does. 64 voxels are counted at a
/// time: the counts of a block are binary numbers whose digits lie in words of one bit per voxel.
class OccupationCounts {
 public:
  /// Of the voxels of `of`, which must outlive the counts.
  explicit OccupationCounts(const OccupiedBlocks& of);

  /// One more keyframe. At most 4,095 are counted. O(blocks of both).
  void add(const OccupiedBlocks& keyframe);
  /// How many keyframes of those added occupy a voxel; 0 if `of` does not. Voxels of one block
  /// after another cost least.
  [[nodiscard]] std::int32_t at(VoxelKey voxel);

 private:
  static constexpr std::size_t kDigits = 12;

  const OccupiedBlocks& of_;
  VoxelTable number_of_;  ///< of a block among those of `of`
  std::vector<std::array<std::uint64_t, kDigits>> digits_;
  VoxelKey last_key_ = 0;
  std::uint32_t last_ = VoxelTable::kNone;
};

}  // namespace unimapper::merge
