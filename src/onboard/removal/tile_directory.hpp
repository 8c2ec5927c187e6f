// Hash table of tiles by position
#pragma once

#include <bit>
#include <cstdint>

#include "src/core/prefetch.hpp"
#include "src/core/voxel_key.hpp"
#include "unimapper/core/arena.hpp"

namespace unimapper::onboard {

/// Open-addressing table from the key of a tile to its number, at most two thirds full. Keys lie in
/// the slots themselves: a look-up is one cache miss. At most `kMaxProbes` slots are looked at.
class TileDirectory {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  /// No slot is left where the key could be: it can't be added either.
  static constexpr std::uint32_t kFull = 0xFFFFFFFEU;
  static constexpr std::uint32_t kMaxProbes = 64;

  void allocate(Arena& arena, std::uint32_t capacity) noexcept {
    const std::size_t slots = std::bit_ceil(std::size_t{capacity} * 3 / 2);
    slots_ = arena.allocate<Slot>(slots);
    mask_ = slots - 1;
    generation_ = 1;
  }

  /// O(1), except once in 2^32 calls.
  void clear() noexcept {
    if (++generation_ != 0) return;
    for (std::size_t i = 0; i <= mask_ && slots_ != nullptr; ++i) slots_[i].generation = 0;
    generation_ = 1;
  }

  /// Number of a tile, `kNone` or `kFull`.
  [[nodiscard]] std::uint32_t find(VoxelKey key) const noexcept {
    auto at = static_cast<std::size_t>(mix_bits(key) & mask_);
    for (std::uint32_t probe = 0; probe < kMaxProbes; ++probe, at = (at + 1) & mask_) {
      if (slots_[at].generation != generation_) return kNone;
      if (slots_[at].key == key) return slots_[at].tile;
    }
    return kFull;
  }

  /// Starts loading the slot where a key is looked for first.
  void prefetch(VoxelKey key) const noexcept {
    prefetch_for_read(slots_ + (mix_bits(key) & mask_));
  }

  /// Adds a tile that is not there; false if there is no slot for it within `kMaxProbes`.
  bool insert(VoxelKey key, std::uint32_t tile) noexcept {
    auto at = static_cast<std::size_t>(mix_bits(key) & mask_);
    for (std::uint32_t probe = 0; probe < kMaxProbes; ++probe, at = (at + 1) & mask_) {
      if (slots_[at].generation == generation_) continue;
      slots_[at] = {key, tile, generation_};
      return true;
    }
    return false;
  }

 private:
  struct Slot {
    VoxelKey key;
    std::uint32_t tile;
    std::uint32_t generation;
  };

  Slot* slots_ = nullptr;
  std::size_t mask_ = 0;
  std::uint32_t generation_ = 1;
};

}  // namespace unimapper::onboard
