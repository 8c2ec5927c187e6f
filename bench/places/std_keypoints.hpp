// Keypoints of a pile: where the points beside a plane crowd when projected onto it.
#pragma once

#include <vector>

#include "bench/places/std_baseline.hpp"
#include "bench/places/std_voxels.hpp"

namespace unimapper::bench {

/// The fullest pixels of all boundary voxels' images.
[[nodiscard]] std::vector<StdKeypoint> find_corners(const StdVoxels& voxels,
                                                    const StdConfig& config);

/// Those no other within the suppression radius equals or exceeds, and of them those with the most
/// points, fullest first.
[[nodiscard]] std::vector<StdKeypoint> select_keypoints(const std::vector<StdKeypoint>& corners,
                                                        const StdConfig& config);

}  // namespace unimapper::bench
