// Integer cell coordinates packed into one 64-bit key.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <concepts>
#include <cstdint>

namespace unimapper {

/// Index of a grid cell: floor(coordinate / cell size) per axis (paper equation 1).
struct VoxelIndex {
  std::int32_t x = 0;  ///< cell along x
  std::int32_t y = 0;  ///< cell along y
  std::int32_t z = 0;  ///< cell along z
  friend bool operator==(const VoxelIndex&, const VoxelIndex&) = default;
};

/// 21 bits per axis, enough for +-209 km at 0.2 m.
using VoxelKey = std::uint64_t;

inline constexpr std::int32_t kVoxelAxisLimit = 1 << 20;

/// True if every axis fits its 21 bits.
[[nodiscard]] constexpr bool is_representable(const VoxelIndex& v) noexcept {
  const auto fits = [](std::int32_t a) { return a >= -kVoxelAxisLimit && a < kVoxelAxisLimit; };
  return fits(v.x) && fits(v.y) && fits(v.z);
}

/// Packs an index; axes outside 21 bits wrap, so check `is_representable` on foreign input.
[[nodiscard]] constexpr VoxelKey pack(const VoxelIndex& v) noexcept {
  const auto axis = [](std::int32_t a) {
    return static_cast<std::uint64_t>(a + kVoxelAxisLimit) & 0x1FFFFFU;
  };
  return axis(v.x) | (axis(v.y) << 21U) | (axis(v.z) << 42U);
}

/// Inverse of `pack`.
[[nodiscard]] constexpr VoxelIndex unpack(VoxelKey key) noexcept {
  const auto axis = [](std::uint64_t bits) {
    return static_cast<std::int32_t>(bits & 0x1FFFFFU) - kVoxelAxisLimit;
  };
  return {axis(key), axis(key >> 21U), axis(key >> 42U)};
}

/// The value, but at most +-2e9, which an integer holds; NaN gives -2e9.
[[nodiscard]] inline float bounded_for_int(float value) noexcept {
  // Comparisons and selections in a form that compilers turn into vector instructions.
  const float not_below = value > -2e9F ? value : -2e9F;
  return not_below < 2e9F ? not_below : 2e9F;
}

/// floor(value) as an integer without calling the maths library, so that it inlines and
/// vectorises; of a value out of `bounded_for_int`.
[[nodiscard]] inline std::int32_t floor_of_bounded(float value) noexcept {
  const auto truncated = static_cast<std::int32_t>(value);
  return truncated - (static_cast<float>(truncated) > value ? 1 : 0);
}

/// floor(value) as an integer, of any value. Saturates at +-2e9, NaN included: what a hostile
/// sender claims is no undefined behaviour.
[[nodiscard]] inline std::int32_t floor_to_int(float value) noexcept {
  return floor_of_bounded(bounded_for_int(value));
}

/// floor(value) of a double without calling the maths library. The caller has checked that it fits
/// the integer.
template <std::signed_integral Integer>
[[nodiscard]] constexpr Integer floor_to(double value) noexcept {
  const auto truncated = static_cast<Integer>(value);
  return static_cast<Integer>(truncated - (static_cast<double>(truncated) > value ? 1 : 0));
}

/// floor(a / b) for b > 0.
[[nodiscard]] constexpr std::int32_t floor_divide(std::int32_t a, std::int32_t b) noexcept {
  return a >= 0 ? a / b : -((-a + b - 1) / b);
}

/// Cell of a point. The caller has checked that the point is finite and within range.
[[nodiscard]] inline VoxelIndex voxel_index(const Eigen::Vector3f& p, float inverse_size) noexcept {
  return {floor_to_int(p.x() * inverse_size), floor_to_int(p.y() * inverse_size),
          floor_to_int(p.z() * inverse_size)};
}

/// Avalanching 64-bit mix (xor-shift-multiply); the same on every machine.
[[nodiscard]] constexpr std::uint64_t mix_bits(std::uint64_t h) noexcept {
  h ^= h >> 32U;
  h *= 0xE9846AF9B1A615DULL;
  h ^= h >> 32U;
  h *= 0xE9846AF9B1A615DULL;
  h ^= h >> 28U;
  return h;
}

}  // namespace unimapper
