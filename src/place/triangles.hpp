// Triangle descriptors of neighbouring keypoints (paper section V-A).
#pragma once

#include <cstdint>
#include <span>

#include "src/core/fixed_vector.hpp"
#include "unimapper/core/keyframe.hpp"
#include "unimapper/place/config.hpp"

namespace unimapper::place {

/// One triangle: the paper's six attributes as integers, and which keypoints it joins. Lengths
/// are horizontal (the frames are levelled), so a triangle is its projection seen from above and
/// has a chirality.
struct Triangle {
  std::uint16_t side_cm[3];  ///< ascending
  std::uint8_t vertex[3];    ///< vertex[i] lies opposite side[i]
  /// |n_j . n_k| of the projection normals at the two ends of side i, in 1/255.
  std::uint8_t dot[3];
  std::uint8_t sketch[3];    ///< `column_sketch` of vertex i
  std::uint8_t left_handed;  ///< 1 if vertex 0, 1, 2 run clockwise seen from above
  /// Direction from vertex 0 to vertex 1 (along the longest side), in 1/65536 turn. Two sightings
  /// of one triangle differ in it by the turn between their frames.
  std::uint16_t heading;
  std::int16_t center_cm[2];  ///< mean of the vertices, horizontal
};
static_assert(sizeof(Triangle) <= 32, "what a triangle may cost in a database of many");

/// Replaces `out` by the triangles of `keypoints` (at most 255; further ones are ignored): for
/// every keypoint, all pairs of its k nearest neighbours. Too long, too short and almost
/// collinear ones are left out, congruent ones are not. Near neighbours come first, then the
/// keypoints' order decides; each set of three vertices appears once. What does not fit `out` is
/// refused by it.
/// Cost: O(n^2 + n k^2).
void build_triangles(std::span<const Keypoint> keypoints, const TriangleConfig& config,
                     FixedVector<Triangle>& out) noexcept;

}  // namespace unimapper::place
