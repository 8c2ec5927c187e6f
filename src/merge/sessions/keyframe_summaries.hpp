// Keyframes of which only the summary has arrived, in a merge.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "unimapper/core/keyframe_record.hpp"

namespace unimapper::merge {

/// Moves the summaries of a session among its keyframes. A merge gives them a pose, finds their
/// loops by descriptor and verifies these with the cells of the nearest whole keyframes of the
/// session; the map, refined labels and changes are of whole keyframes. O(keyframes).
void include_summaries(SessionData& session);

/// The nearest whole keyframes, at most `count` on each side of keyframe `k` and none more than 64
/// keyframes away: the nearest first, of two as near the one before first.
std::vector<std::size_t> whole_neighbours(std::span<const KeyframeRecord> keyframes, std::size_t k,
                                          std::size_t count);

/// The static cells of the nearest whole keyframe on each side of keyframe `k`, if it was made
/// within 50 m of it, in its frame by odometry. O(cells).
std::vector<FineCell> neighbouring_cells(const SessionData& session, std::size_t k);

}  // namespace unimapper::merge
