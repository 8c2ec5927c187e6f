#include "cell_store.hpp"

#include <algorithm>
#include <iterator>

namespace unimapper::onboard {

void CellStore::allocate(Arena& arena, const VoxelConfig& config) noexcept {
  capacity_ = config.max_cells;
  max_groups_ = static_cast<std::uint32_t>(max_entries(config) / kGroup);
  // One for every 54 cells is needed, with every sensor measured.
  max_large_ = capacity_ / 24;
  occupied_ = arena.allocate<std::uint64_t>(config.max_blocks());
  blocks_ = arena.allocate<BlockCells>(config.max_blocks());
  large_ = arena.allocate<LargeBlock>(max_large_);
  sums_ = arena.allocate<CellSums>(max_entries(config));
}

void CellStore::add_block(const VoxelIndex& index) noexcept {
  occupied_[block_count_] = 0;
  BlockCells& cells = blocks_[block_count_];
  std::fill(std::begin(cells.low_rank), std::end(cells.low_rank), std::uint8_t{0});
  cells.large = kNone;
  cells.index = index;
  ++block_count_;
}

std::uint32_t CellStore::insert(std::uint32_t block, std::uint32_t bit) noexcept {
  BlockCells& cells = blocks_[block];
  const std::uint32_t rank = popcount(occupied_[block]);
  const bool has_room = size_ < capacity_ && (rank % kGroup != 0 || groups_ < max_groups_) &&
                        (rank != kFew || large_count_ < max_large_);
  if (!has_room) return kNone;
  occupied_[block] |= std::uint64_t{1} << bit;
  cells.low_rank[bit / 2] |= static_cast<std::uint8_t>(rank % kFew << (bit % 2 * 4U));
  if (rank < kFew) {
    if (rank % kGroup == 0) cells.group[rank / kGroup] = groups_++;
  } else {
    if (rank == kFew) {
      cells.large = large_count_++;
      large_[cells.large] = {};
    }
    LargeBlock& large = large_[cells.large];
    large.high_rank[bit / 4] |= static_cast<std::uint8_t>(rank / kFew << (bit % 4 * 2U));
    if (rank % kGroup == 0) large.group[(rank - kFew) / kGroup] = groups_++;
  }
  ++size_;
  const std::uint32_t entry = entry_at(cells, rank);
  sums_[entry] = {};
  return entry;
}

}  // namespace unimapper::onboard
