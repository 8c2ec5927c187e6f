// Sliding-window block index
#pragma once

#include <cstdint>
#include <span>

#include "src/core/parts.hpp"
#include "src/core/prefetch.hpp"
#include "src/free_space/block.hpp"
#include "src/onboard/keyframe/grid.hpp"
#include "tile_directory.hpp"
#include "unimapper/core/arena.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// What was decided about the cells of a block in one keyframe, one bit per cell.
struct BlockHistory {
  std::uint64_t occupied;
  std::uint64_t dynamic;  ///< of the occupied ones
  std::uint64_t proven;   ///< of the dynamic ones: in their own right
  std::uint32_t first;    ///< row of the first one in that keyframe's table
};

/// The blocks (4 x 4 x 4 cells) that any keyframe of the window occupies. A block is looked up
/// once per keyframe; its occupancy in earlier keyframes then lies side by side, and its neighbours
/// are an array access away: blocks are kept in tiles of 4 x 4 x 4 that store the tiles around
/// them.
///
/// Blocks that no keyframe occupies any more are freed with the last one that did. What finds no
/// room evicts the oldest keyframe from the window; if that does not help it is refused.
class BlockWindow {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  void allocate(Arena& arena, const PipelineConfig& config) noexcept;

  /// `call(context)` comes before any keyframe is gone earlier than after the window's length:
  /// forgotten, or evicted because the store is full. Whatever reads its occupancy still must do so
  /// then.
  void before_early_eviction(void (*call)(void*), void* context) noexcept {
    early_eviction_ = call;
    early_eviction_context_ = context;
  }

  /// Forgets every keyframe. O(window).
  void forget() noexcept;
  /// Begins a keyframe whose blocks are counted in `grid`. Keyframes too far from the first one
  /// to be counted in its grid forget it.
  void begin(const Grid& grid) noexcept;

  /// Enters a block (counted in the current grid) into the current keyframe. Returns how many were
  /// entered before it, or `kNone` if there is no room for it. O(1), now and then O(blocks of the
  /// keyframe evicted early).
  std::uint32_t enter(const VoxelIndex& block) noexcept;

  /// Start loading what `enter` will read of a block, each once the one before has arrived: the
  /// slot of its tile in the directory; the tile, whose number is returned, or `kNone`; the block's
  /// number.
  void prefetch_directory(const VoxelIndex& block) const noexcept {
    directory_.prefetch(pack(at(block).tile));
  }
  [[nodiscard]] std::uint32_t prefetch_tile(const VoxelIndex& block) const noexcept;
  void prefetch_number(std::uint32_t tile, const VoxelIndex& block) const noexcept {
    if (tile == kNone) return;
    const std::uint32_t entry = tiles_[tile].entries[at(block).position];
    if (entry != kNone) prefetch_for_write(number_ + entry);
  }

  /// Numbers the blocks of the current keyframe once all are entered: tile by tile, so that what
  /// lies side by side in space is processed in sequence. All that follows uses these numbers.
  /// `occupied`: cells of each block, in the order of entry. O(blocks).
  void arrange(std::span<const std::uint64_t> occupied, const Executor& executor = {}) noexcept;
  /// By number: what `enter` returned for the block.
  [[nodiscard]] std::span<const std::uint32_t> order() const noexcept {
    return {order_, entered_[current_].count};
  }

  /// Number of the block next to block `number` in the current keyframe, or `kNone`.
  [[nodiscard]] std::uint32_t neighbour(std::uint32_t number,
                                        const BlockOffset& offset) const noexcept {
    const std::uint32_t at = position_of_number_[number];
    const std::int32_t x = static_cast<std::int32_t>(at & 3U) + offset.x;
    const std::int32_t y = static_cast<std::int32_t>((at >> 2U) & 3U) + offset.y;
    const std::int32_t z = static_cast<std::int32_t>((at >> 4U) & 3U) + offset.z;
    const Tile* tile = tiles_ + (at >> 6U);
    if (((x | y | z) & ~3) != 0) {
      const std::int32_t around = ((x + 4) >> 2) + 3 * ((y + 4) >> 2) + 9 * ((z + 4) >> 2);
      const std::uint32_t other = tile->around[around];
      if (other == kNone) return kNone;
      tile = tiles_ + other;
      if (tile->keyframe != keyframe_) return kNone;
    }
    const auto position = static_cast<std::uint32_t>((x & 3) | ((y & 3) << 2) | ((z & 3) << 4));
    return (tile->entered >> position & 1U) != 0 ? number_[tile->entries[position]] : kNone;
  }

  /// Cells of a block that were occupied `age` keyframes ago, from 1 to the window's length.
  [[nodiscard]] std::uint64_t occupied(std::uint32_t number, std::uint32_t age) const noexcept {
    return history_[entry_of(number) * std::size_t{slots_} + slot(age)];
  }
  /// Occupied cells of a block, one mask for every keyframe of the window and for the current one.
  /// In no particular order.
  [[nodiscard]] std::span<const std::uint64_t> occupied(std::uint32_t number) const noexcept {
    return {history_ + entry_of(number) * std::size_t{slots_}, slots_};
  }
  /// Takes cells of a block of the current keyframe out of its occupancy.
  void leave_out(std::uint32_t number, std::uint64_t cells) noexcept {
    history_[entry_of(number) * std::size_t{slots_} + current_] &= ~cells;
  }
  /// Entry of a block by its number: names it as long as any keyframe that occupies it is in the
  /// window.
  [[nodiscard]] std::uint32_t entry(std::uint32_t number) const noexcept {
    return entry_of(number);
  }
  /// Cells of a block that were occupied from `first` to below `end` keyframes ago, 0 being the
  /// current one: as many words.
  void occupied_entry(std::uint32_t entry, std::uint32_t first, std::uint32_t end,
                      std::uint64_t* words) const noexcept {
    const std::uint64_t* const history = history_ + entry * std::size_t{slots_};
    std::uint32_t at = slot(first);
    for (std::uint32_t age = first; age < end; ++age) {
      *words++ = history[at];
      at = (at == 0 ? slots_ : at) - 1;
    }
  }

  /// Starts loading what `occupied_entry` reads; any entry will do.
  void prefetch_entry(std::uint32_t entry) const noexcept {
    const std::uint64_t* const history = history_ + entry * std::size_t{slots_};
    prefetch_for_read(history);
    prefetch_for_read(history + slots_ - 1);
  }

  /// Number of the current keyframe since the beginning, and how long ago another one was.
  [[nodiscard]] std::uint32_t keyframe() const noexcept { return keyframe_; }
  [[nodiscard]] std::uint32_t age_of(std::uint32_t keyframe) const noexcept {
    return keyframe_ - keyframe;
  }
  /// Keyframes remembered beside the current one, and how many there can be at most.
  [[nodiscard]] std::uint32_t earlier_count() const noexcept { return earlier_; }
  [[nodiscard]] std::uint32_t longest_age() const noexcept { return slots_ - 1; }

  /// What the keyframe before decided about a block.
  [[nodiscard]] BlockHistory before(std::uint32_t number) const noexcept {
    const std::uint32_t then = number_before_[number];
    return then != kNone && earlier_ > 0 ? decided_[then] : BlockHistory{0, 0, 0, 0};
  }

  /// Records what was decided about a block. From the first one on, nothing says any more what was
  /// decided `before`.
  void record(std::uint32_t number, const BlockHistory& decided) noexcept {
    decided_[number] = decided;
  }
  /// Makes the current keyframe the latest earlier one. O(blocks of the evicted one), and now
  /// and then O(tiles).
  void advance() noexcept;
  /// Instead of `advance`: the current keyframe leaves nothing, as if none of its blocks had been
  /// entered. O(its blocks).
  void discard() noexcept;

  /// Blocks of the current keyframe that have a number.
  [[nodiscard]] std::uint32_t numbered() const noexcept { return entered_[current_].count; }
  /// Blocks held, and how many there is room for: all of it where the current or last keyframe
  /// evicted others early, be it for want of blocks or of tiles.
  [[nodiscard]] std::uint32_t size() const noexcept { return evicted_early_ ? capacity_ : used_; }
  [[nodiscard]] std::uint32_t capacity() const noexcept { return capacity_; }

 private:
  static constexpr std::uint32_t kEdgeBits = 2;
  static constexpr std::uint32_t kBlocks = 64;
  static constexpr std::uint32_t kAround = 27;

  struct Tile {
    VoxelKey key;
    std::uint32_t used;      ///< blocks it holds
    std::uint32_t keyframe;  ///< for which `entered` holds
    std::uint64_t entered;   ///< positions whose block the keyframe entered, one bit each
    std::uint32_t around[kAround];
    std::uint32_t entries[kBlocks];  ///< by position, or `kNone`
  };
  struct Held {
    std::uint32_t position;       ///< tile in the upper 26 bits, position in it in the lower 6
    std::uint32_t last_keyframe;  ///< last recorded one that entered it, or the one it was made for
    std::uint32_t last_number;    ///< of the block in `last_keyframe`
  };
  /// The blocks of one keyframe, in the order of their numbers.
  struct Entered {
    std::uint32_t* entries;
    std::uint32_t count;
    std::uint32_t keyframe;
  };

  /// A block of the current grid by its tile and its position there.
  struct TilePosition {
    VoxelIndex tile;
    std::uint32_t position;
  };
  [[nodiscard]] TilePosition at(const VoxelIndex& block) const noexcept {
    const VoxelIndex at{block.x + shift_.x, block.y + shift_.y, block.z + shift_.z};
    return {{at.x >> kEdgeBits, at.y >> kEdgeBits, at.z >> kEdgeBits},
            static_cast<std::uint32_t>((at.x & 3) | ((at.y & 3) << 2) | ((at.z & 3) << 4))};
  }
  [[nodiscard]] std::uint32_t slot(std::uint32_t age) const noexcept {
    return (current_ + slots_ - age) % slots_;
  }
  [[nodiscard]] std::uint32_t entry_of(std::uint32_t number) const noexcept {
    return entered_[current_].entries[number];
  }
  [[nodiscard]] bool tiles_left() const noexcept {
    return free_tile_count_ > 0 || fresh_tiles_ < tile_capacity_;
  }
  [[nodiscard]] bool blocks_left() const noexcept { return free_count_ > 0 || fresh_ < capacity_; }
  [[nodiscard]] std::uint32_t find_tile(VoxelKey key) noexcept;
  std::uint32_t make_tile(const VoxelIndex& index) noexcept;
  [[nodiscard]] bool has_entered(const Tile& tile, std::uint32_t position) const noexcept {
    return tile.keyframe == keyframe_ && (tile.entered >> position & 1U) != 0;
  }
  /// Gives numbers from `number` on to the blocks that were entered into some tiles.
  void number_tiles(Slice tiles, std::uint32_t number,
                    std::span<const std::uint64_t> occupied) noexcept;
  /// Gives a number to the block at a position (as in `Held::position`).
  void number_block(std::uint32_t number, std::uint32_t position, std::uint64_t occupied) noexcept;
  bool make_block(std::uint32_t tile, std::uint32_t position) noexcept;
  void evict(Entered& entered) noexcept;
  /// No keyframe of the window occupies the block any more.
  void free_block(std::uint32_t entry) noexcept;
  /// Evicts the oldest keyframe; false if there is none.
  bool make_room() noexcept;
  /// Takes the tiles without blocks away.
  void purge_tiles() noexcept;

  void (*early_eviction_)(void*) = nullptr;
  void* early_eviction_context_ = nullptr;
  Grid origin_;
  VoxelIndex shift_;  ///< from blocks of the current grid to blocks of the origin's
  bool started_ = false;
  bool evicted_early_ = false;  ///< since `begin`

  std::uint32_t slots_ = 2;  ///< of the ring of keyframes: window + 1
  std::uint32_t current_ = 0;
  std::uint32_t earlier_ = 0;  ///< keyframes remembered
  std::uint32_t keyframe_ = 1;
  std::uint32_t max_entered_ = 0;
  std::uint32_t entered_count_ = 0;  ///< blocks entered into the current keyframe
  std::uint32_t entered_tile_count_ = 0;
  std::uint32_t* entered_tiles_ = nullptr;       ///< tiles that hold them
  std::uint32_t* order_ = nullptr;               ///< by number
  std::uint32_t* position_of_number_ = nullptr;  ///< as `Held::position`, by number
  std::uint32_t* number_before_ = nullptr;  ///< by number: that in the keyframe before, or none
  BlockHistory* decided_ = nullptr;         ///< by number in the keyframe before, until `record`
  Entered entered_[RemovalConfig::kMaxWindow + 1] = {};

  // Blocks: fresh ones from the front, then those that were freed.
  std::uint32_t capacity_ = 0;
  std::uint32_t used_ = 0;
  std::uint32_t fresh_ = 0;
  std::uint32_t free_count_ = 0;
  std::uint32_t* free_ = nullptr;
  Held* held_ = nullptr;
  /// Number of an entered block in the current keyframe, by entry; before `arrange` in the order
  /// of entry.
  std::uint32_t* number_ = nullptr;
  std::uint64_t* history_ = nullptr;  ///< occupied cells, `slots_` words per block

  std::uint32_t tile_capacity_ = 0;
  std::uint32_t fresh_tiles_ = 0;
  std::uint32_t free_tile_count_ = 0;
  std::uint32_t* free_tiles_ = nullptr;
  Tile* tiles_ = nullptr;
  TileDirectory directory_;
  // The tile of the last look-up: neighbours are mostly looked up in sequence.
  VoxelKey last_key_ = 0;
  std::uint32_t last_tile_ = kNone;
};

}  // namespace unimapper::onboard
