// Distance between the walls of two clouds.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <span>

namespace unimapper::merge {

/// How far apart two clouds have the walls that both hold. NaN where they share none.
struct WallDistance {
  double median_m = std::numeric_limits<double>::quiet_NaN();  ///< over the points of walls
  double p90_m = std::numeric_limits<double>::quiet_NaN();     ///< nine tenths are nearer
  std::size_t points = 0;  ///< of the first cloud that lie at a wall of the second
};

/// Distances of up to `max_queries` points of the first cloud, evenly strided, from planes of the
/// second: the plane through its points within 1 m, where these are flat and steep. It shows what
/// AC hides: how far off a merge is, whatever the two LiDARs see in common. O(n log n).
[[nodiscard]] WallDistance wall_distance(std::span<const Eigen::Vector3f> first,
                                         std::span<const Eigen::Vector3f> second,
                                         std::size_t max_queries = 20'000);

}  // namespace unimapper::merge
