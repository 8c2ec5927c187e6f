// Counter-based random numbers.
//
// Every draw is a hash of (key, counter), so the value for a ray or a house does not depend on the
// order in which threads compute it.
#pragma once

#include <cmath>
#include <cstdint>

namespace unimapper::simulator {

/// A 64-bit finaliser (Stafford's variant 13); bijective.
constexpr std::uint64_t mix64(std::uint64_t x) {
  x ^= x >> 30U;
  x *= 0xBF58476D1CE4E5B9ULL;
  x ^= x >> 27U;
  x *= 0x94D049BB133111EBULL;
  x ^= x >> 31U;
  return x;
}

/// Combines a key with one more coordinate (scan, ray, house number, ...).
constexpr std::uint64_t derive_key(std::uint64_t key, std::uint64_t coordinate) {
  return mix64(key + 0x9E3779B97F4A7C15ULL * (coordinate + 1));
}

/// Purpose of a random stream; separates the streams of one seed.
enum class Stream : std::uint64_t {
  kPlan = 1,
  kBlock,
  kPrototype,
  kFurniture,
  kParking,
  kTraffic,
  kPedestrian,
  kRay,
  kDeskew,
  kOdometry,
  kMotion,
};

class Random {
 public:
  explicit Random(std::uint64_t key) : key_(key) {}
  Random(std::uint64_t seed, Stream stream, std::uint64_t a = 0, std::uint64_t b = 0)
      : key_(derive_key(derive_key(derive_key(mix64(seed), static_cast<std::uint64_t>(stream)), a),
                        b)) {}

  std::uint64_t bits() { return mix64(key_ + 0x9E3779B97F4A7C15ULL * ++counter_); }
  /// Uniform in [0, 1).
  double uniform() { return static_cast<double>(bits() >> 11U) * 0x1p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  bool chance(double probability) { return uniform() < probability; }
  /// Uniform in [0, count).
  std::uint32_t index(std::uint32_t count) {
    return static_cast<std::uint32_t>(((bits() >> 32U) * count) >> 32U);
  }
  /// Standard normal (Box-Muller; the second value is dropped to keep draws countable).
  double gauss() {
    const double u = 1.0 - uniform();
    return std::sqrt(-2.0 * std::log(u)) * std::cos(6.283185307179586 * uniform());
  }

 private:
  std::uint64_t key_;
  std::uint64_t counter_ = 0;
};

}  // namespace unimapper::simulator
