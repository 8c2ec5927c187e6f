// Scaling benchmark: cost of a keyframe over its points and over the distance driven.
#pragma once

#include <filesystem>

namespace unimapper::bench {

/// Writes `points.csv` (points per keyframe, ms, ns per point): 1000 to 2 million points.
void measure_points(const std::filesystem::path& folder);

/// Writes `distance.csv` (keyframe, km, ms in all and of the loop search; medians of a hundred
/// keyframes): `keyframes` of them, ten metres apart.
void measure_distance(const std::filesystem::path& folder, int keyframes);

}  // namespace unimapper::bench
