// Bit-sliced counters of the cells of a block
#pragma once

#include <cstdint>
#include <span>

namespace unimapper::onboard {

/// In how many of up to 63 words each of 64 cells is set: a counter per cell, the counters' digits
/// side by side, so that one addition serves all cells.
class CellCounts {
 public:
  explicit CellCounts(std::span<const std::uint64_t> words) noexcept
      : more_than_15_(words.size() > 15) {
    // Four words at a time: they and the two lowest digits are added at once.
    std::size_t i = 0;
    for (; i + 3 < words.size(); i += 4) {
      const std::uint64_t first = add_two(digits_[0], words[i], words[i + 1]);
      const std::uint64_t second = add_two(digits_[0], words[i + 2], words[i + 3]);
      add<2>(add_two(digits_[1], first, second));
    }
    for (; i < words.size(); ++i) add<0>(words[i]);
  }

  /// Of the cell with this number.
  [[nodiscard]] std::int32_t of(std::uint32_t bit) const noexcept {
    const std::uint32_t count = digits_at<0, kFewDigits>(bit);
    return static_cast<std::int32_t>(more_than_15_ ? count | digits_at<kFewDigits, kDigits>(bit)
                                                   : count);
  }

 private:
  static constexpr std::uint32_t kDigits = 6;

  static constexpr std::uint32_t kFewDigits = 4;  ///< of counts up to 15

  /// Adds two words to a digit. Returns what is carried to the next one.
  static std::uint64_t add_two(std::uint64_t& digit, std::uint64_t a, std::uint64_t b) noexcept {
    const std::uint64_t one = a ^ b;
    const std::uint64_t carry = (a & b) | (one & digit);
    digit ^= one;
    return carry;
  }
  /// From digit `first` on. All of them every time: where a carry ends cannot be predicted.
  template <std::uint32_t first>
  void add(std::uint64_t carry) noexcept {
    carry = add_up<first, kFewDigits>(carry);
    if (more_than_15_) add_up<kFewDigits, kDigits>(carry);
  }
  template <std::uint32_t first, std::uint32_t end>
  std::uint64_t add_up(std::uint64_t carry) noexcept {
    for (std::uint32_t d = first; d < end; ++d) {
      const std::uint64_t both = digits_[d] & carry;
      digits_[d] ^= carry;
      carry = both;
    }
    return carry;
  }
  template <std::uint32_t first, std::uint32_t end>
  [[nodiscard]] std::uint32_t digits_at(std::uint32_t bit) const noexcept {
    std::uint32_t count = 0;
    for (std::uint32_t d = first; d < end; ++d) {
      count |= static_cast<std::uint32_t>(digits_[d] >> bit & 1U) << d;
    }
    return count;
  }

  bool more_than_15_;
  std::uint64_t digits_[kDigits] = {};
};

}  // namespace unimapper::onboard
