#include "cell_store.hpp"

#include <algorithm>

namespace unimapper::onboard {

void CellStore::allocate(Arena& arena, const VoxelConfig& config) noexcept {
  capacity_ = config.max_cells;
  blocks_ = arena.allocate<Block>(config.max_blocks());
  cells_ = arena.allocate<BlockCells>(config.max_blocks());
  sums_ = arena.allocate<CellSums>(max_entries(config));
}

void CellStore::add_block(const VoxelIndex& index) noexcept {
  blocks_[block_count_] = {0, index, 0};
  std::fill_n(cells_[block_count_].rank, Block::kCells, kNoRank);
  ++block_count_;
}

std::uint32_t CellStore::insert(std::uint32_t block, std::uint32_t bit) noexcept {
  if (size_ == capacity_) return kNone;
  const std::uint32_t rank = popcount(blocks_[block].occupied);
  blocks_[block].occupied |= std::uint64_t{1} << bit;
  cells_[block].rank[bit] = static_cast<std::uint8_t>(rank);
  if (rank % kGroup == 0) cells_[block].group[rank / kGroup] = groups_++;
  ++size_;
  const std::uint32_t entry = entry_at(block, rank);
  sums_[entry] = {};
  return entry;
}

}  // namespace unimapper::onboard
