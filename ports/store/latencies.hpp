// Distribution of times.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>

namespace unimapper::store {

/// How often something took how long.
struct Latencies {
  /// Longest times of all ranges but the last one.
  static constexpr std::array<std::chrono::milliseconds, 9> kBounds{
      std::chrono::milliseconds(3),      std::chrono::milliseconds(10),
      std::chrono::milliseconds(30),     std::chrono::milliseconds(100),
      std::chrono::milliseconds(300),    std::chrono::milliseconds(1000),
      std::chrono::milliseconds(3000),   std::chrono::milliseconds(10'000),
      std::chrono::milliseconds(100'000)};
  std::array<std::uint64_t, kBounds.size() + 1> counts{};  ///< by range
  std::chrono::nanoseconds total{0};                       ///< of all times

  /// Counts one.
  void add(std::chrono::nanoseconds time) {
    const auto range = std::lower_bound(kBounds.begin(), kBounds.end(), time);
    ++counts[static_cast<std::size_t>(range - kBounds.begin())];
    total += time;
  }
};

}  // namespace unimapper::store
