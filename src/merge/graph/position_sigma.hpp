// Marginal standard deviations of keyframe positions in a merged map.
#pragma once

#include <vector>

#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/merge/merge_config.hpp"
#include "unimapper/merge/merger.hpp"

namespace unimapper::merge {

/// By session and keyframe `MergedSession::position_sigma_m` of a result with poses and loops.
/// Empty for sessions outside the map, and for all where the loops leave one free. Known positions
/// do not count. Costs two factorisations of the pose graph.
[[nodiscard]] std::vector<std::vector<double>> position_sigmas_m(
    const std::vector<SessionData>& sessions, const MergeResult& result,
    const OdometryNoiseConfig& odometry);

}  // namespace unimapper::merge
