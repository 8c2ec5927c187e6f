// The grid on which keyframes travel.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "unimapper/core/keyframe.hpp"
#include "unimapper/merge/keyframe_record.hpp"

namespace unimapper::wire {

/// Puts every cell, keypoint and plane of `record` on the wire's grid: cells and plane centres
/// to 1 cm within +-327 m, keypoints to 1 mm within +-1000 m, normals to 2 x 16 bits. What lies
/// beyond, or is not finite, is removed and counted in `record.left_out`. Cells are sorted.
/// Afterwards the record equals what the base will decode, bit for bit; doing it twice changes
/// nothing. Cost: O(n log n) in the cells.
void quantise(merge::KeyframeRecord& record);

/// One cell as it travels, ordered as it travels: by 2.56 m block, ground before the rest, by
/// position, by points. From the top: block x y z (8 bits each, offset 128), not-ground (1),
/// x y z within the block in cm (8 each), points (8).
using CellKey = std::uint64_t;

/// Sorted keys of `cells`; those that cannot be represented are added to `left_out`.
std::vector<CellKey> cell_keys(std::span<const FineCell> cells, std::uint64_t& left_out);

/// The cell of a key.
FineCell cell_of(CellKey key);

/// A unit vector unfolded from an octahedron onto a square of 16-bit coordinates.
struct OctahedralNormal {
  std::int16_t u = 0;
  std::int16_t v = 0;
  friend bool operator==(const OctahedralNormal&, const OctahedralNormal&) = default;
};

/// Nearest code of a normal (error below 1e-4 rad), or nothing if it is zero or not finite.
std::optional<OctahedralNormal> octahedral(const Eigen::Vector3f& normal);
/// The unit vector of a code.
Eigen::Vector3f unit_vector(OctahedralNormal code);
/// True for the codes `octahedral` returns: on the seam of the square two codes mean the same
/// vector and one of them is never used.
bool is_canonical(OctahedralNormal code);

inline constexpr std::int32_t kKeypointLimitMm = 1'000'000;

/// Position of a keypoint in whole millimetres, or nothing if it is not finite or beyond
/// `kKeypointLimitMm` on an axis.
std::optional<Eigen::Vector3i> to_millimetres(const Eigen::Vector3f& position);
Eigen::Vector3f from_millimetres(const Eigen::Vector3i& millimetres);

/// Position of a cell or plane in whole centimetres, or nothing if it is not finite or does not
/// fit 16 bits on an axis.
std::optional<Eigen::Vector3i> to_centimetres(const Eigen::Vector3f& position);
Eigen::Vector3f from_centimetres(const Eigen::Vector3i& centimetres);

}  // namespace unimapper::wire
