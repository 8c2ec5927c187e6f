// STD triangles of neighbouring keypoints.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "bench/places/std_baseline.hpp"

namespace unimapper::bench {

/// Vertices are ordered by their adjacent sides: the two shorter ones, the shortest and the
/// longest, the two longer ones.
struct StdTriangle {
  Eigen::Vector3d sides;                  ///< ascending, in units of `side_resolution_m`
  Eigen::Vector3d counts;                 ///< of the vertices
  std::array<std::uint32_t, 3> vertices;  ///< numbers of keypoints
};

/// Of several triangles with equal sides (to the millimetre) only the first is kept, even if the
/// others have other vertices.
[[nodiscard]] std::vector<StdTriangle> form_triangles(const std::vector<StdKeypoint>& keypoints,
                                                      const StdConfig& config);

}  // namespace unimapper::bench
