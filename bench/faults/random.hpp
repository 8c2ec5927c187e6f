// Pseudo-random numbers of a seed and a running number.
#pragma once

#include <cstdint>

#include "unimapper/core/voxel_key.hpp"

namespace unimapper::bench {

/// The same numbers on every machine.
class Random {
 public:
  explicit Random(std::uint64_t seed, std::uint64_t number = 0)
      : state_(mix_bits(seed * 0x9E3779B97F4A7C15ULL + 1) ^ mix_bits(number + 1)) {}

  /// 64 of them.
  std::uint64_t bits() { return mix_bits(state_ += 0x9E3779B97F4A7C15ULL); }
  /// In [0, limit).
  std::uint32_t below(std::uint32_t limit) { return static_cast<std::uint32_t>(bits() % limit); }
  /// In [0, 1).
  double uniform() { return static_cast<double>(bits() >> 11U) / 9007199254740992.0; }
  /// In [low, high).
  double uniform(double low, double high) { return low + (high - low) * uniform(); }

 private:
  std::uint64_t state_;
};

}  // namespace unimapper::bench
