#include "block_window.hpp"

#include <algorithm>

namespace unimapper::onboard {
namespace {

/// The tile around number `i` of 27, and the number by which that one knows this one.
VoxelIndex around_offset(std::uint32_t i) noexcept {
  const auto n = static_cast<std::int32_t>(i);
  return {n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
}
constexpr std::uint32_t opposite(std::uint32_t i) noexcept { return 26U - i; }

}  // namespace

void BlockWindow::attach(Arena& arena, const PipelineConfig& config) noexcept {
  slots_ = config.removal.window + 1;
  capacity_ = config.voxel.max_window_blocks;
  max_entered_ = config.voxel.max_blocks();
  // A tile that is there holds a block; on surfaces it holds several.
  tile_capacity_ = std::max(capacity_ / 4, 64U);
  free_ = arena.allocate<std::uint32_t>(capacity_);
  place_ = arena.allocate<std::uint32_t>(capacity_);
  last_met_ = arena.allocate<std::uint32_t>(capacity_);
  history_ = arena.allocate<std::uint64_t>(std::size_t{capacity_} * slots_);
  dynamic_ = arena.allocate<std::uint64_t>(capacity_);
  proven_ = arena.allocate<std::uint64_t>(capacity_);
  free_tiles_ = arena.allocate<std::uint32_t>(tile_capacity_);
  tiles_ = arena.allocate<Tile>(tile_capacity_);
  directory_.attach(arena, tile_capacity_);
  place_of_number_ = arena.allocate<std::uint32_t>(max_entered_);
  for (std::uint32_t i = 0; i < slots_; ++i) {
    entered_[i].entries = arena.allocate<std::uint32_t>(max_entered_);
  }
}

void BlockWindow::forget() noexcept {
  for (Entered& entered : entered_) entered.count = 0;
  earlier_ = 0;
  used_ = fresh_ = free_count_ = 0;
  fresh_tiles_ = free_tile_count_ = 0;
  directory_.clear();
  last_tile_ = kNone;
  ++keyframe_;
}

void BlockWindow::begin(const Grid& grid) noexcept {
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

std::uint32_t BlockWindow::enter(const VoxelIndex& block) noexcept {
  const VoxelIndex at{block.x + shift_.x, block.y + shift_.y, block.z + shift_.z};
  const VoxelIndex tile_index{at.x >> kEdgeBits, at.y >> kEdgeBits, at.z >> kEdgeBits};
  const auto place = static_cast<std::uint32_t>((at.x & 3) | ((at.y & 3) << 2) | ((at.z & 3) << 4));
  std::uint32_t tile = find_tile(pack(tile_index));
  if (tile != kNone && tiles_[tile].keyframe == keyframe_ && tiles_[tile].numbers[place] != kNone) {
    return tiles_[tile].numbers[place];
  }
  if (entered_[current_].count < max_entered_) {
    if (tile == kNone) tile = make_tile(tile_index);
    std::uint32_t entry = tile != kNone ? tiles_[tile].blocks[place] : kNone;
    if (tile != kNone && entry == kNone) entry = make_block(tile, place);
    if (entry != kNone) return number(entry);
  }
  return kNone;
}

std::uint32_t BlockWindow::number(std::uint32_t entry) noexcept {
  Entered& entered = entered_[current_];
  Tile& tile = tiles_[place_[entry] >> 6U];
  if (tile.keyframe != keyframe_) {
    tile.keyframe = keyframe_;
    std::fill_n(tile.numbers, kBlocks, kNone);
  }
  tile.numbers[place_[entry] & 63U] = entered.count;
  last_met_[entry] = keyframe_;
  place_of_number_[entered.count] = place_[entry];
  entered.entries[entered.count] = entry;
  return entered.count++;
}

std::uint32_t BlockWindow::find_tile(VoxelKey key) noexcept {
  if (key == last_key_ && last_tile_ != kNone) return last_tile_;
  const std::uint32_t found = directory_.find(key);
  if (found != kNone) {
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
  std::fill_n(made.numbers, kBlocks, kNone);
  std::fill_n(made.blocks, kBlocks, kNone);
  for (std::uint32_t i = 0; i < kAround; ++i) {
    const VoxelIndex offset = around_offset(i);
    made.around[i] =
        directory_.find(pack({index.x + offset.x, index.y + offset.y, index.z + offset.z}));
    if (made.around[i] != kNone) tiles_[made.around[i]].around[opposite(i)] = tile;
  }
  last_key_ = key;
  last_tile_ = tile;
  return tile;
}

std::uint32_t BlockWindow::make_block(std::uint32_t tile, std::uint32_t place) noexcept {
  while (!blocks_left() && make_room()) {
  }
  if (!blocks_left()) return kNone;
  const std::uint32_t entry = free_count_ > 0 ? free_[--free_count_] : fresh_++;
  ++used_;
  ++tiles_[tile].used;
  tiles_[tile].blocks[place] = entry;
  place_[entry] = (tile << 6U) | place;
  std::fill_n(history_ + entry * std::size_t{slots_}, slots_, std::uint64_t{0});
  dynamic_[entry] = proven_[entry] = 0;
  return entry;
}

BlockHistory BlockWindow::before(std::uint32_t number) const noexcept {
  const std::uint64_t cells = occupied(number, 1);
  // Verdicts are those of the last keyframe that met the block, which may be longer ago.
  if (cells == 0) return {0, 0, 0};
  const std::uint32_t entry = entry_of(number);
  return {cells, dynamic_[entry], proven_[entry]};
}

void BlockWindow::record(std::uint32_t number, const BlockHistory& decided) noexcept {
  const std::uint32_t entry = entry_of(number);
  history_[entry * std::size_t{slots_} + current_] = decided.occupied;
  dynamic_[entry] = decided.dynamic;
  proven_[entry] = decided.proven;
}

void BlockWindow::advance() noexcept {
  entered_[current_].keyframe = keyframe_;
  ++keyframe_;
  current_ = (current_ + 1) % slots_;
  earlier_ = std::min(earlier_ + 1, slots_ - 1);
  expire(entered_[current_]);
  const std::uint32_t tiles_free = free_tile_count_ + tile_capacity_ - fresh_tiles_;
  if (tiles_free < tile_capacity_ / 4) purge_tiles();
}

void BlockWindow::expire(Entered& entered) noexcept {
  const auto leaving = static_cast<std::size_t>(&entered - entered_);
  for (std::uint32_t i = 0; i < entered.count; ++i) {
    const std::uint32_t entry = entered.entries[i];
    history_[entry * std::size_t{slots_} + leaving] = 0;
    if (last_met_[entry] != entered.keyframe) continue;  // met again since
    Tile& tile = tiles_[place_[entry] >> 6U];
    tile.blocks[place_[entry] & 63U] = kNone;
    --tile.used;
    --used_;
    free_[free_count_++] = entry;
  }
  entered.count = 0;
}

bool BlockWindow::make_room() noexcept {
  if (earlier_ == 0) return false;
  expire(entered_[slot(earlier_)]);
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
