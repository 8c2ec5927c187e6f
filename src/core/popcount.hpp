// Population count of a word.
#pragma once

#include <cstdint>

namespace unimapper {

/// Number of set bits. `std::popcount` calls a table look-up where the instruction cannot be
/// assumed; this stays inline.
[[nodiscard]] constexpr std::uint32_t popcount(std::uint64_t bits) noexcept {
  bits -= (bits >> 1U) & 0x5555555555555555ULL;
  bits = (bits & 0x3333333333333333ULL) + ((bits >> 2U) & 0x3333333333333333ULL);
  bits = (bits + (bits >> 4U)) & 0x0F0F0F0F0F0F0F0FULL;
  return static_cast<std::uint32_t>((bits * 0x0101010101010101ULL) >> 56U);
}

}  // namespace unimapper
