// Keyframes of which only the summary has arrived, in a merge.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "unimapper/core/keyframe_record.hpp"

namespace unimapper::merge {

/// Moves the summaries of a session among its keyframes and returns how many there were. A merge
/// gives them a pose, finds their loops by descriptor and verifies these with the cells of the
/// nearest whole keyframes of the session; the map, refined labels and changes are of whole
/// keyframes. O(keyframes).
std::size_t include_summaries(SessionData& session);

/// The static cells of the nearest whole keyframes before and after keyframe `k`, as far as they
/// were made within 50 m of it, in its frame by odometry. O(keyframes between + cells).
std::vector<FineCell> neighbouring_cells(std::span<const KeyframeRecord> keyframes, std::size_t k);

}  // namespace unimapper::merge
