// Bit-sliced counters of the cells of a block
#pragma once

#include <cstdint>
#include <span>

namespace unimapper::onboard {

/// In how many of up to 63 words each of 64 cells is set: a counter per cell, the counters' digits
/// side by side, so that one addition serves all cells.
class CellCounts {
 public:
  explicit CellCounts(std::span<const std::uint64_t> words) noexcept {
    // Two words at a time: both and the lowest digits are added at once.
    std::size_t i = 0;
    for (; i + 1 < words.size(); i += 2) {
      const std::uint64_t one = words[i] ^ words[i + 1];
      add<1>((words[i] & words[i + 1]) | (one & digits_[0]));
      digits_[0] ^= one;
    }
    if (i < words.size()) add<0>(words[i]);
  }

  /// Of the cell with this number.
  [[nodiscard]] std::int32_t of(std::uint32_t bit) const noexcept {
    std::uint32_t count = 0;
    for (std::uint32_t d = 0; d < kDigits; ++d) {
      count |= static_cast<std::uint32_t>(digits_[d] >> bit & 1U) << d;
    }
    return static_cast<std::int32_t>(count);
  }

 private:
  static constexpr std::uint32_t kDigits = 6;

  /// From digit `first` on. All of them every time: where a carry ends cannot be predicted.
  template <std::uint32_t first>
  void add(std::uint64_t carry) noexcept {
    for (std::uint32_t d = first; d < kDigits; ++d) {
      const std::uint64_t both = digits_[d] & carry;
      digits_[d] ^= carry;
      carry = both;
    }
  }

  std::uint64_t digits_[kDigits] = {};
};

}  // namespace unimapper::onboard
