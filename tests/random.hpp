// Pseudo-random numbers that are the same on every machine.
#pragma once

#include <cstdint>

#include "src/core/voxel_key.hpp"

namespace unimapper::test {

class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  /// 64 of them.
  std::uint64_t bits() { return mix_bits(state_ += 0x9E3779B97F4A7C15ULL); }
  /// In [0, limit).
  std::uint32_t below(std::uint32_t limit) { return static_cast<std::uint32_t>(bits() % limit); }
  /// In [0, 1).
  double uniform() { return static_cast<double>(bits() >> 11U) / 9007199254740992.0; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }

 private:
  std::uint64_t state_;
};

}  // namespace unimapper::test
