#include "occupied_voxels.hpp"

#include <algorithm>

#include "src/free_space/block.hpp"

namespace unimapper::merge {

std::optional<VoxelKey> observed_voxel(const Eigen::Vector3d& point, float size_m) {
  const Eigen::Array3d scaled = point.array() / static_cast<double>(size_m);
  // Also false for NaN.
  if (!(scaled.abs().maxCoeff() < static_cast<double>(kVoxelAxisLimit - 8))) return std::nullopt;
  return pack({floor_to<std::int32_t>(scaled.x()), floor_to<std::int32_t>(scaled.y()),
               floor_to<std::int32_t>(scaled.z())});
}

OccupiedBlocks::OccupiedBlocks(const KeyframeRecord& keyframe, const Pose& T_map_keyframe,
                               float size_m) {
  VoxelTable table;
  VoxelKey last_key = 0;
  std::uint32_t last = VoxelTable::kNone;
  for (const auto* cells : {&keyframe.static_cells, &keyframe.dynamic_cells}) {
    for (const FineCell& cell : *cells) {
      const auto voxel = observed_voxel(T_map_keyframe * cell.position.cast<double>(), size_m);
      if (!voxel) continue;
      const VoxelIndex index = unpack(*voxel);
      const VoxelKey key = pack(block_of(index));
      // Cells that follow each other often share a block.
      if (last == VoxelTable::kNone || key != last_key) last = table.find_or_insert(key);
      last_key = key;
      if (last == blocks_.size()) blocks_.push_back({key, 0});
      blocks_[last].voxels |= std::uint64_t{1} << bit_of(index);
    }
  }
  std::sort(blocks_.begin(), blocks_.end(),
            [](const Block& a, const Block& b) { return a.key < b.key; });
}

OccupationCounts::OccupationCounts(const OccupiedBlocks& of)
    : of_(of), digits_(of.blocks().size()) {
  for (const OccupiedBlocks::Block& block : of.blocks()) {
    static_cast<void>(number_of_.find_or_insert(block.key));
  }
}

void OccupationCounts::add(const OccupiedBlocks& keyframe) {
  auto other = keyframe.blocks().begin();
  const auto end = keyframe.blocks().end();
  for (std::size_t b = 0; b < digits_.size(); ++b) {
    const OccupiedBlocks::Block& own = of_.blocks()[b];
    while (other != end && other->key < own.key) ++other;
    if (other == end) return;
    if (other->key != own.key) continue;
    std::uint64_t carry = own.voxels & other->voxels;
    for (std::size_t digit = 0; digit < kDigits && carry != 0; ++digit) {
      const std::uint64_t both = digits_[b][digit] & carry;
      digits_[b][digit] ^= carry;
      carry = both;
    }
  }
}

std::int32_t OccupationCounts::at(VoxelKey voxel) {
  const VoxelIndex index = unpack(voxel);
  const VoxelKey key = pack(block_of(index));
  if (last_ == VoxelTable::kNone || key != last_key_) last_ = number_of_.find(key);
  last_key_ = key;
  if (last_ == VoxelTable::kNone) return 0;
  const std::uint32_t bit = bit_of(index);
  std::int32_t count = 0;
  for (std::size_t digit = 0; digit < kDigits; ++digit) {
    count |= static_cast<std::int32_t>(digits_[last_][digit] >> bit & 1U) << digit;
  }
  return count;
}

}  // namespace unimapper::merge
