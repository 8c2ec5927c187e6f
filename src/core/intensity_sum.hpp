// Mean of intensities in one word.
#pragma once

#include <cstdint>

namespace unimapper {

/// Intensities of one byte each; the first 4095 of them count.
class IntensitySum {
 public:
  void add(std::uint8_t intensity) noexcept {
    if (count() < kMost) word_ += (std::uint32_t{intensity} << kCountBits) + 1U;
  }
  [[nodiscard]] std::uint32_t count() const noexcept { return word_ & kMost; }
  [[nodiscard]] std::uint32_t sum() const noexcept { return word_ >> kCountBits; }

  /// Rounded, at least 1; 0 without any.
  [[nodiscard]] static std::uint8_t mean(std::uint32_t sum, std::uint32_t count) noexcept {
    if (count == 0) return 0;
    const std::uint32_t rounded = (sum + count / 2) / count;
    return static_cast<std::uint8_t>(rounded == 0 ? 1U : rounded);
  }
  [[nodiscard]] std::uint8_t mean() const noexcept { return mean(sum(), count()); }

 private:
  static constexpr std::uint32_t kCountBits = 12;
  static constexpr std::uint32_t kMost = (1U << kCountBits) - 1;
  std::uint32_t word_ = 0;
};

}  // namespace unimapper
