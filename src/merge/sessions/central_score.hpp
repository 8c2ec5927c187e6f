// Suitability of each session as the central map.
#pragma once

#include <vector>

#include "src/merge/loops/loop_verifier.hpp"
#include "unimapper/core/keyframe_record.hpp"

namespace unimapper::merge {

/// The paper's two conditions (section VI) as one number in [0, 1] per session: a wide area
/// covered with intra-session loops, and a sensor with a wide field of view and many keypoints.
/// Everything is measured from the keyframes, relative to the best session.
std::vector<double> central_scores(const std::vector<SessionData>& sessions,
                                   const std::vector<LoopConstraint>& intra_session_loops);

}  // namespace unimapper::merge
