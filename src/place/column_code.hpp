// Similarity of column occupancy codes.
#pragma once

#include <cstdint>

#include "src/core/popcount.hpp"

namespace unimapper::place {

/// Dice similarity of two occupancy columns (`Keypoint::occupancy`): twice the common heights over
/// the sum of both, [0, 1]. Empty columns are like nothing.
[[nodiscard]] constexpr float column_similarity(std::uint64_t a, std::uint64_t b) noexcept {
  const std::uint32_t sum = popcount(a) + popcount(b);
  return sum == 0 ? 0.0F : 2.0F * static_cast<float>(popcount(a & b)) / static_cast<float>(sum);
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
