// Open-addressing hash map of fixed capacity, laid out in an arena.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include "unimapper/core/arena.hpp"
#include "voxel_key.hpp"

namespace unimapper {

/// Maps 64-bit keys to values that lie densely, in insertion order until the first `erase`, so
/// iteration is deterministic and cache friendly. Linear probing over at most `kMaxProbes` slots;
/// what finds no slot, or no room among the values, is refused and counted. Clearing costs O(1):
/// slots carry the generation in which they were filled.
///
/// Cost: one expected cache miss per look-up; at most `kMaxProbes` slots in the worst case.
template <typename Value>
class FixedHashMap {
 public:
  static constexpr std::uint32_t kMaxProbes = 64;  ///< slots a look-up visits at most
  /// What a look-up returns for an absent key.
  static constexpr std::uint32_t kNotFound = 0xFFFFFFFFU;

  /// Takes room for `capacity` entries; the slot table is at most half full.
  void allocate(Arena& arena, std::size_t capacity) noexcept {
    const std::size_t slot_count = std::bit_ceil(capacity < 1 ? 2 : capacity * 2);
    slots_ = arena.allocate<Slot>(slot_count);
    keys_ = arena.allocate<std::uint64_t>(capacity);
    values_ = arena.allocate<Value>(capacity);
    const bool ready = slots_ != nullptr && keys_ != nullptr && values_ != nullptr;
    capacity_ = ready ? static_cast<std::uint32_t>(capacity) : 0;
    mask_ = slot_count - 1;
    size_ = 0;
    refused_ = 0;
    generation_ = 1;
  }

  /// Forgets every entry and the refusals. O(1), except once in 2^32 calls.
  void clear() noexcept {
    size_ = 0;
    refused_ = 0;
    if (++generation_ != 0) return;
    for (std::size_t i = 0; i <= mask_ && slots_ != nullptr; ++i) slots_[i].generation = 0;
    generation_ = 1;
  }

  /// Forgets every entry whatever the memory holds by now: others may have used it. O(capacity).
  void reset() noexcept {
    clear();
    for (std::size_t i = 0; i <= mask_ && slots_ != nullptr; ++i) slots_[i].generation = 0;
    generation_ = 1;
  }

  /// Index of the entry with `key`, or `kNotFound`.
  [[nodiscard]] std::uint32_t find(std::uint64_t key) const noexcept {
    if (capacity_ == 0) return kNotFound;
    std::size_t slot = static_cast<std::size_t>(mix_bits(key)) & mask_;
    for (std::uint32_t probe = 0; probe < kMaxProbes; ++probe, slot = (slot + 1) & mask_) {
      if (slots_[slot].generation != generation_) return kNotFound;
      if (keys_[slots_[slot].entry] == key) return slots_[slot].entry;
    }
    return kNotFound;
  }

  /// Index of the entry with `key`, made with a value-initialised value if it was not there.
  /// `kNotFound`, and counted, if it does not fit.
  std::uint32_t find_or_insert(std::uint64_t key) noexcept {
    if (capacity_ == 0) return kNotFound;
    std::size_t slot = static_cast<std::size_t>(mix_bits(key)) & mask_;
    for (std::uint32_t probe = 0; probe < kMaxProbes; ++probe, slot = (slot + 1) & mask_) {
      if (slots_[slot].generation != generation_) {
        if (size_ == capacity_) break;
        slots_[slot] = {size_, generation_};
        keys_[size_] = key;
        values_[size_] = Value{};
        return size_++;
      }
      if (keys_[slots_[slot].entry] == key) return slots_[slot].entry;
    }
    ++refused_;
    return kNotFound;
  }

  /// Drops an entry, below `size()`; the last one takes its index. The slots behind it move up, so
  /// a look-up never visits more slots than before. At most `kMaxProbes` plus the length of the run
  /// of filled slots behind the entry's.
  void erase(std::uint32_t entry) noexcept {
    std::size_t hole = slot_of(entry);
    const std::uint32_t last = size_ - 1;
    if (entry != last) {
      slots_[slot_of(last)].entry = entry;
      keys_[entry] = keys_[last];
      values_[entry] = values_[last];
    }
    size_ = last;
    // `hole` names the slot by position, which moving the last entry has not changed.
    for (std::size_t slot = (hole + 1) & mask_; slots_[slot].generation == generation_;
         slot = (slot + 1) & mask_) {
      const std::size_t home =
          static_cast<std::size_t>(mix_bits(keys_[slots_[slot].entry])) & mask_;
      // A slot whose look-up begins behind the hole stays.
      if (((slot - home) & mask_) < ((slot - hole) & mask_)) continue;
      slots_[hole] = slots_[slot];
      hole = slot;
    }
    slots_[hole].generation = generation_ - 1;
  }

  /// Entries in use.
  [[nodiscard]] std::uint32_t size() const noexcept { return size_; }
  /// Entries there is room for.
  [[nodiscard]] std::uint32_t capacity() const noexcept { return capacity_; }
  /// Whether every further key is refused.
  [[nodiscard]] bool full() const noexcept { return size_ == capacity_; }
  /// Insertions that found no room since the last `clear()`.
  [[nodiscard]] std::uint64_t refused() const noexcept { return refused_; }

  /// Key of an entry, below `size()`.
  [[nodiscard]] std::uint64_t key(std::uint32_t entry) const noexcept { return keys_[entry]; }
  Value& operator[](std::uint32_t entry) noexcept { return values_[entry]; }
  const Value& operator[](std::uint32_t entry) const noexcept { return values_[entry]; }
  /// Values of all entries, in the order of their insertion until the first `erase`.
  [[nodiscard]] std::span<Value> values() noexcept { return {values_, size_}; }
  /// Values of all entries, in the order of their insertion until the first `erase`.
  [[nodiscard]] std::span<const Value> values() const noexcept { return {values_, size_}; }
  /// Keys of all entries, in the order of their insertion until the first `erase`.
  [[nodiscard]] std::span<const std::uint64_t> keys() const noexcept { return {keys_, size_}; }

 private:
  struct Slot {
    std::uint32_t entry;
    std::uint32_t generation;
  };

  /// Slot of an entry that there is.
  [[nodiscard]] std::size_t slot_of(std::uint32_t entry) const noexcept {
    std::size_t slot = static_cast<std::size_t>(mix_bits(keys_[entry])) & mask_;
    while (slots_[slot].entry != entry || slots_[slot].generation != generation_) {
      slot = (slot + 1) & mask_;
    }
    return slot;
  }

  Slot* slots_ = nullptr;
  std::uint64_t* keys_ = nullptr;
  Value* values_ = nullptr;
  std::size_t mask_ = 0;
  std::uint32_t capacity_ = 0;
  std::uint32_t size_ = 0;
  std::uint32_t generation_ = 1;
  std::uint64_t refused_ = 0;
};

}  // namespace unimapper
