#include "block_window.hpp"

#include <algorithm>
#include <bit>

#include "src/core/prefetch.hpp"

namespace unimapper::onboard {
namespace {

/// Offset of the tile with number `i` among the 27 around and including this one.
VoxelIndex around_offset(std::uint32_t i) noexcept {
  const auto n = static_cast<std::int32_t>(i);
  return {n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
}
constexpr std::uint32_t kEntriesAhead = 12;  ///< blocks that are loaded in advance

constexpr std::uint32_t opposite(std::uint32_t i) noexcept { return 26U - i; }

}  // namespace

void BlockWindow::allocate(Arena& arena, const PipelineConfig& config) noexcept {
  slots_ = config.removal.window + 1;
  capacity_ = config.voxel.max_window_blocks;
  max_entered_ = config.voxel.max_blocks();
  // On surfaces a tile holds nine blocks and more, with every sensor measured. Where there is room
  // for few, they may lie apart.
  tile_capacity_ = std::max({capacity_ / 8, std::min(capacity_ / 6, 2048U), 64U});
  free_ = arena.allocate<std::uint32_t>(capacity_);
  held_ = arena.allocate<Held>(capacity_);
  number_ = arena.allocate<std::uint32_t>(capacity_);
  history_ = arena.allocate<std::uint64_t>(std::size_t{capacity_} * slots_);
  free_tiles_ = arena.allocate<std::uint32_t>(tile_capacity_);
  entered_tiles_ = arena.allocate<std::uint32_t>(tile_capacity_);
  tiles_ = arena.allocate<Tile>(tile_capacity_);
  directory_.allocate(arena, tile_capacity_);
  order_ = arena.allocate<std::uint32_t>(max_entered_);
  position_of_number_ = arena.allocate<std::uint32_t>(max_entered_);
  number_before_ = arena.allocate<std::uint32_t>(max_entered_);
  decided_ = arena.allocate<BlockHistory>(max_entered_);
  for (std::uint32_t i = 0; i < slots_; ++i) {
    entered_[i].entries = arena.allocate<std::uint32_t>(max_entered_);
  }
}

void BlockWindow::forget() noexcept {
  if (early_eviction_ != nullptr) early_eviction_(early_eviction_context_);
  for (Entered& entered : entered_) entered.count = 0;
  earlier_ = 0;
  used_ = fresh_ = free_count_ = 0;
  fresh_tiles_ = free_tile_count_ = 0;
  entered_count_ = entered_tile_count_ = 0;
  directory_.clear();
  last_tile_ = kNone;
  ++keyframe_;
}

void BlockWindow::begin(const Grid& grid) noexcept {
  evicted_early_ = false;
  GridShift shift;
  if (started_) shift = shift_between(grid, origin_);
  if (!started_ || !shift.representable) {
    forget();
    origin_ = grid;
    started_ = true;
    shift = {true, {}};
  }
  // Lattice steps are whole blocks.
  shift_ = {shift.cells.x >> 2, shift.cells.y >> 2, shift.cells.z >> 2};
}

std::uint32_t BlockWindow::prefetch_tile(const VoxelIndex& block) const noexcept {
  const auto [tile_index, position] = at(block);
  const std::uint32_t found = directory_.find(pack(tile_index));
  if (found >= TileDirectory::kFull) return kNone;
  prefetch_for_write(tiles_ + found);
  prefetch_for_read(tiles_[found].entries + position);
  return found;
}

std::uint32_t BlockWindow::enter(const VoxelIndex& block) noexcept {
  const auto [tile_index, position] = at(block);
  const std::uint32_t found = find_tile(pack(tile_index));
  // Hostile keys may collide: what finds no slot is not looked for twice.
  if (found == TileDirectory::kFull) return kNone;
  if (found != kNone && has_entered(tiles_[found], position)) {
    return number_[tiles_[found].entries[position]];
  }
  if (entered_count_ == max_entered_) return kNone;
  const std::uint32_t at_tile = found == kNone ? make_tile(tile_index) : found;
  if (at_tile == kNone) return kNone;
  Tile& tile = tiles_[at_tile];
  if (tile.entries[position] == kNone && !make_block(at_tile, position)) return kNone;
  if (tile.keyframe != keyframe_) tile.entered = 0;
  tile.keyframe = keyframe_;
  if (tile.entered == 0) entered_tiles_[entered_tile_count_++] = at_tile;
  tile.entered |= std::uint64_t{1} << position;
  return number_[tile.entries[position]] = entered_count_++;
}

void BlockWindow::arrange(std::span<const std::uint64_t> occupied,
                          const Executor& executor) noexcept {
  constexpr std::uint32_t kTilesPerPart = 64;
  const Cut tiles(executor, {0, entered_tile_count_}, kTilesPerPart);
  std::uint32_t first[Cut::kMost];
  count_before(executor, tiles, 0, first, [&](Slice some) noexcept {
    std::uint32_t blocks = 0;
    for (std::uint32_t t = some.first; t < some.end; ++t) {
      blocks += popcount(tiles_[entered_tiles_[t]].entered);
    }
    return blocks;
  });
  for_parts(executor, tiles.parts(), [&](std::uint32_t part, std::uint32_t) noexcept {
    number_tiles(tiles[part], first[part], occupied);
  });
  entered_[current_].count = entered_count_;
}

void BlockWindow::number_tiles(Slice tiles, std::uint32_t number,
                               std::span<const std::uint64_t> occupied) noexcept {
  for (std::uint32_t t = tiles.first; t < tiles.end; ++t) {
    Tile& tile = tiles_[entered_tiles_[t]];
    for (std::uint64_t left = tile.entered; left != 0; left &= left - 1) {
      const std::uint32_t entry = tile.entries[std::countr_zero(left)];
      prefetch_for_read(occupied.data() + number_[entry]);
      prefetch_for_write(held_ + entry);
      prefetch_for_write(history_ + entry * std::size_t{slots_} + current_);
    }
    for (std::uint64_t left = tile.entered; left != 0; left &= left - 1) {
      const auto position = static_cast<std::uint32_t>(std::countr_zero(left));
      number_block(number++, (entered_tiles_[t] << 6U) | position,
                   occupied[number_[tile.entries[position]]]);
    }
  }
}

void BlockWindow::number_block(std::uint32_t number, std::uint32_t position,
                               std::uint64_t occupied) noexcept {
  const std::uint32_t entry = tiles_[position >> 6U].entries[position & 63U];
  Held& held = held_[entry];
  entered_[current_].entries[number] = entry;
  order_[number] = number_[entry];
  position_of_number_[number] = position;
  // What was decided longer ago than in the keyframe before no longer counts.
  number_before_[number] = held.last_keyframe + 1 == keyframe_ ? held.last_number : kNone;
  history_[entry * std::size_t{slots_} + current_] = occupied;
  number_[entry] = number;
}

std::uint32_t BlockWindow::find_tile(VoxelKey key) noexcept {
  if (key == last_key_ && last_tile_ != kNone) return last_tile_;
  const std::uint32_t found = directory_.find(key);
  if (found < TileDirectory::kFull) {
    last_key_ = key;
    last_tile_ = found;
  }
  return found;
}

std::uint32_t BlockWindow::make_tile(const VoxelIndex& index) noexcept {
  if (!tiles_left()) purge_tiles();
  while (!tiles_left() && make_room()) purge_tiles();
  if (!tiles_left()) return kNone;
  const VoxelKey key = pack(index);
  const std::uint32_t tile =
      free_tile_count_ > 0 ? free_tiles_[free_tile_count_ - 1] : fresh_tiles_;
  if (!directory_.insert(key, tile)) return kNone;
  if (free_tile_count_ > 0) {
    --free_tile_count_;
  } else {
    ++fresh_tiles_;
  }
  Tile& made = tiles_[tile];
  made.key = key;
  made.used = 0;
  made.keyframe = keyframe_;
  made.entered = 0;
  std::fill_n(made.entries, kBlocks, kNone);
  for (std::uint32_t i = 0; i < kAround; ++i) {
    const VoxelIndex offset = around_offset(i);
    const std::uint32_t other =
        directory_.find(pack({index.x + offset.x, index.y + offset.y, index.z + offset.z}));
    made.around[i] = other < TileDirectory::kFull ? other : kNone;
    if (made.around[i] != kNone) tiles_[made.around[i]].around[opposite(i)] = tile;
  }
  last_key_ = key;
  last_tile_ = tile;
  return tile;
}

bool BlockWindow::make_block(std::uint32_t tile, std::uint32_t position) noexcept {
  while (!blocks_left() && make_room()) {
  }
  if (!blocks_left()) return false;
  const std::uint32_t entry = free_count_ > 0 ? free_[--free_count_] : fresh_++;
  ++used_;
  ++tiles_[tile].used;
  tiles_[tile].entries[position] = entry;
  held_[entry] = {(tile << 6U) | position, keyframe_, kNone};
  std::fill_n(history_ + entry * std::size_t{slots_}, slots_, std::uint64_t{0});
  return true;
}

void BlockWindow::advance() noexcept {
  Entered& recorded = entered_[current_];
  recorded.keyframe = keyframe_;
  for (std::uint32_t i = 0; i < recorded.count; ++i) {
    if (i + kEntriesAhead < recorded.count) {
      prefetch_for_write(held_ + recorded.entries[i + kEntriesAhead]);
    }
    Held& held = held_[recorded.entries[i]];
    held.last_keyframe = keyframe_;
    held.last_number = i;
  }
  ++keyframe_;
  entered_count_ = entered_tile_count_ = 0;
  current_ = (current_ + 1) % slots_;
  earlier_ = std::min(earlier_ + 1, slots_ - 1);
  evict(entered_[current_]);
  const std::uint32_t tiles_free = free_tile_count_ + tile_capacity_ - fresh_tiles_;
  if (tiles_free < tile_capacity_ / 4) purge_tiles();
}

void BlockWindow::evict(Entered& entered) noexcept {
  const auto evicted = static_cast<std::size_t>(&entered - entered_);
  for (std::uint32_t i = 0; i < entered.count; ++i) {
    const std::uint32_t entry = entered.entries[i];
    if (i + kEntriesAhead < entered.count) {
      const std::uint32_t next = entered.entries[i + kEntriesAhead];
      prefetch_for_write(history_ + next * std::size_t{slots_} + evicted);
      prefetch_for_read(held_ + next);
    }
    history_[entry * std::size_t{slots_} + evicted] = 0;
    const Held& held = held_[entry];
    const Tile& tile = tiles_[held.position >> 6U];
    const bool still_occupied =
        held.last_keyframe != entered.keyframe || has_entered(tile, held.position & 63U);
    if (!still_occupied) free_block(entry);
  }
  entered.count = 0;
}

void BlockWindow::discard() noexcept {
  Entered& discarded = entered_[current_];
  for (std::uint32_t i = 0; i < discarded.count; ++i) {
    const std::uint32_t entry = discarded.entries[i];
    history_[entry * std::size_t{slots_} + current_] = 0;
    const std::uint32_t age = age_of(held_[entry].last_keyframe);
    // Made for this keyframe, or kept for it alone since an earlier one was evicted.
    if (age == 0 || age > earlier_) free_block(entry);
  }
  discarded.count = 0;
  for (std::uint32_t t = 0; t < entered_tile_count_; ++t) tiles_[entered_tiles_[t]].entered = 0;
  entered_count_ = entered_tile_count_ = 0;
}

void BlockWindow::free_block(std::uint32_t entry) noexcept {
  const std::uint32_t position = held_[entry].position;
  Tile& tile = tiles_[position >> 6U];
  tile.entries[position & 63U] = kNone;
  --tile.used;
  --used_;
  free_[free_count_++] = entry;
}

bool BlockWindow::make_room() noexcept {
  if (earlier_ == 0) return false;
  if (early_eviction_ != nullptr) early_eviction_(early_eviction_context_);
  evicted_early_ = true;
  evict(entered_[slot(earlier_)]);
  --earlier_;
  return true;
}

void BlockWindow::purge_tiles() noexcept {
  directory_.clear();
  last_tile_ = kNone;
  free_tile_count_ = 0;
  for (std::uint32_t t = 0; t < fresh_tiles_; ++t) {
    Tile& tile = tiles_[t];
    if (tile.used > 0) {
      // A key that finds no slot this time is merely not found again.
      (void)directory_.insert(tile.key, t);
      continue;
    }
    for (std::uint32_t i = 0; i < kAround; ++i) {
      if (tile.around[i] != kNone) tiles_[tile.around[i]].around[opposite(i)] = kNone;
      tile.around[i] = kNone;
    }
    free_tiles_[free_tile_count_++] = t;
  }
}

}  // namespace unimapper::onboard
