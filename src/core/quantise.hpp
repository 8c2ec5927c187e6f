// Quantisation of positions and normals, the same on robot and base.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

namespace unimapper {

/// A unit vector unfolded from an octahedron onto a square of 16-bit coordinates.
struct OctahedralNormal {
  std::int16_t u = 0;  ///< first coordinate on the square
  std::int16_t v = 0;  ///< second coordinate on the square
  friend bool operator==(const OctahedralNormal&, const OctahedralNormal&) = default;
};

/// Nearest code of a normal (error below 1e-4 rad), or nothing if it is zero or not finite.
std::optional<OctahedralNormal> octahedral(const Eigen::Vector3f& normal) noexcept;
/// The unit vector of a code; its code is that code again, if it is canonical.
Eigen::Vector3f unit_vector(OctahedralNormal code) noexcept;
/// True for the codes `octahedral` returns: on the seam of the square two codes mean the same
/// vector and one of them is never used.
bool is_canonical(OctahedralNormal code) noexcept;

inline constexpr std::int32_t kMillimetreLimit = 1'000'000;

/// A position in whole millimetres, or nothing if it is not finite or beyond `kMillimetreLimit` on
/// an axis.
std::optional<Eigen::Vector3i> to_millimetres(const Eigen::Vector3f& position) noexcept;
/// The position at whole millimetres; `to_millimetres` gives them back.
Eigen::Vector3f from_millimetres(const Eigen::Vector3i& millimetres) noexcept;

/// A position in whole centimetres, or nothing if it is not finite or does not fit 16 bits on an
/// axis.
std::optional<Eigen::Vector3i> to_centimetres(const Eigen::Vector3f& position) noexcept;
/// The position at whole centimetres; `to_centimetres` gives them back.
Eigen::Vector3f from_centimetres(const Eigen::Vector3i& centimetres) noexcept;

}  // namespace unimapper
