// Growing hash table from voxel keys to consecutive numbers.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "src/core/voxel_key.hpp"

namespace unimapper::merge {

/// Open addressing; numbers are given in the order of insertion, so what is stored under them
/// has a deterministic order.
class VoxelTable {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  /// Without growing there is room for `expected` keys, at most a few thousand.
  explicit VoxelTable(std::size_t expected = 0)
      : slots_(std::bit_ceil(std::clamp<std::size_t>(2 * expected + 1, 1024, 16384)), kNone) {}

  /// Number of `key`, which may be new: then it is `size()` of before the call.
  std::uint32_t find_or_insert(VoxelKey key) {
    if (2 * keys_.size() >= slots_.size()) grow();
    std::size_t slot = mix_bits(key) & (slots_.size() - 1);
    while (slots_[slot] != kNone) {
      if (keys_[slots_[slot]] == key) return slots_[slot];
      slot = (slot + 1) & (slots_.size() - 1);
    }
    slots_[slot] = static_cast<std::uint32_t>(keys_.size());
    keys_.push_back(key);
    return slots_[slot];
  }

  /// Number of `key`, or kNone.
  [[nodiscard]] std::uint32_t find(VoxelKey key) const {
    std::size_t slot = mix_bits(key) & (slots_.size() - 1);
    while (slots_[slot] != kNone) {
      if (keys_[slots_[slot]] == key) return slots_[slot];
      slot = (slot + 1) & (slots_.size() - 1);
    }
    return kNone;
  }

  /// Gives memory back; from then on nothing is found or inserted, only `key` answers.
  void keep_keys_only() {
    slots_ = std::vector<std::uint32_t>();
    keys_.shrink_to_fit();
  }

  /// Gives all memory back; from then on nothing is found or inserted.
  void clear() {
    slots_ = std::vector<std::uint32_t>();
    keys_ = std::vector<VoxelKey>();
  }

  [[nodiscard]] std::size_t size() const { return keys_.size(); }
  [[nodiscard]] const std::vector<VoxelKey>& keys() const { return keys_; }
  [[nodiscard]] VoxelKey key(std::uint32_t number) const { return keys_[number]; }

 private:
  void grow() {
    // What is small grows faster, what is large takes less.
    constexpr std::size_t kSmall = std::size_t{1} << 20U;
    std::vector<std::uint32_t> larger(slots_.size() * (slots_.size() < kSmall ? 4 : 2), kNone);
    for (std::uint32_t number = 0; number < keys_.size(); ++number) {
      std::size_t slot = mix_bits(keys_[number]) & (larger.size() - 1);
      while (larger[slot] != kNone) slot = (slot + 1) & (larger.size() - 1);
      larger[slot] = number;
    }
    slots_.swap(larger);
  }

  std::vector<std::uint32_t> slots_;  // a power of two, at most half full
  std::vector<VoxelKey> keys_;
};

}  // namespace unimapper::merge
