// Structure of one keyframe in the free space of another.
#pragma once

#include "keyframe_clouds.hpp"
#include "unimapper/merge/merge_config.hpp"

namespace unimapper::merge {

/// Share of the structure (no ground) of one keyframe that the other one saw through, of all it
/// observed within 25 m; the larger of both directions. 0 where fewer than 50 points were
/// observed.
[[nodiscard]] double structure_in_free_space(const KeyframeClouds& clouds, KeyframeId match,
                                             KeyframeId query, const Pose& T_match_query,
                                             const MergeConfig& config);

}  // namespace unimapper::merge
