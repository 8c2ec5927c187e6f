// STD keypoints: densest pixels of boundary points projected onto a plane.
#pragma once

#include <vector>

#include "bench/places/std_baseline.hpp"
#include "bench/places/std_voxels.hpp"

namespace unimapper::bench {

/// The densest pixels of all boundary voxels' images.
[[nodiscard]] std::vector<StdKeypoint> find_corners(const StdVoxels& voxels,
                                                    const StdConfig& config);

/// Non-maximum suppression: corners that no other within the suppression radius equals or exceeds,
/// of these the ones with the most points, densest first.
[[nodiscard]] std::vector<StdKeypoint> select_keypoints(const std::vector<StdKeypoint>& corners,
                                                        const StdConfig& config);

}  // namespace unimapper::bench
