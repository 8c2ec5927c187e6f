// Similarity of column occupancy codes.
#pragma once

#include <cstdint>

namespace unimapper::place {

/// Number of set bits. `std::popcount` calls a table look-up where the instruction cannot be
/// assumed; this stays inline.
[[nodiscard]] constexpr std::uint32_t count_ones(std::uint64_t bits) noexcept {
  bits -= (bits >> 1U) & 0x5555555555555555ULL;
  bits = (bits & 0x3333333333333333ULL) + ((bits >> 2U) & 0x3333333333333333ULL);
  bits = (bits + (bits >> 4U)) & 0x0F0F0F0F0F0F0F0FULL;
  return static_cast<std::uint32_t>((bits * 0x0101010101010101ULL) >> 56U);
}

/// Dice similarity of two occupancy columns (`Keypoint::occupancy`): twice the common heights over
/// the sum of both, [0, 1]. Empty columns are like nothing.
[[nodiscard]] constexpr float column_similarity(std::uint64_t a, std::uint64_t b) noexcept {
  const std::uint32_t sum = count_ones(a) + count_ones(b);
  return sum == 0 ? 0.0F : 2.0F * static_cast<float>(count_ones(a & b)) / static_cast<float>(sum);
}

/// Eight bits of a column for quick comparison: which of eight bands of height hold anything. Bands
/// grow with height (0.4 m at the foot, 3.6 m at the top), as fewer rays reach what is high.
[[nodiscard]] constexpr std::uint8_t column_sketch(std::uint64_t occupancy) noexcept {
  // First slice of each band; what is lower than two slices is no structure.
  constexpr std::uint32_t kFirst[9] = {2, 4, 7, 11, 16, 23, 32, 46, 64};
  std::uint32_t sketch = 0;
  for (std::uint32_t band = 0; band < 8; ++band) {
    const std::uint64_t below_next =
        kFirst[band + 1] == 64 ? ~0ULL : (1ULL << kFirst[band + 1]) - 1;
    const std::uint64_t below_first = (1ULL << kFirst[band]) - 1;
    if ((occupancy & (below_next & ~below_first)) != 0) sketch |= 1U << band;
  }
  return static_cast<std::uint8_t>(sketch);
}

}  // namespace unimapper::place
