// Loop candidates between nearby keyframes of aligned sessions (paper section VI, R).
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "loop_search.hpp"
#include "unimapper/merge/alignment.hpp"

namespace unimapper::merge {

/// Pairs of keyframes of connected sessions within the radius: per query keyframe and other
/// session the nearest few that look the same way if both look narrowly, keyframes spaced along
/// the query's path. Within a session too, where the path between is long enough. Pairs that
/// are loops already are left out, and sessions before the query's beyond the
/// `kSessionsPerKeyframe` that hold it by loops.
std::vector<LoopCandidate> find_radius_candidates(const std::vector<SessionData>& sessions,
                                                  const Alignment& alignment,
                                                  std::span<const LoopConstraint> known,
                                                  const MergeConfig& config);

/// Candidates of a radius search between two sessions alone, whether they are connected or not. The
/// poses of both, by keyframe, are in one frame.
std::vector<LoopCandidate> find_radius_candidates(const std::vector<SessionData>& sessions,
                                                  std::size_t query, std::size_t match,
                                                  std::vector<Pose> T_common_query_keyframe,
                                                  std::vector<Pose> T_common_match_keyframe,
                                                  const MergeConfig& config);

}  // namespace unimapper::merge
