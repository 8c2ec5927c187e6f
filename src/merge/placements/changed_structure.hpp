// Structure that stood during one visit of a place and not during another
#pragma once

#include <optional>
#include <span>

#include "src/merge/registration/keyframe_clouds.hpp"

namespace unimapper::merge {

/// Poses of all keyframes of one session in one frame, metres.
using VisitPoses = std::span<const Pose>;

/// A keyframe of one visit of a place.
struct Visit {
  KeyframeId keyframe;
  VisitPoses T_session_keyframe;
};

/// Of the structure (no ground) within 15 m of both keyframes that the other visit observed, the
/// share that has changed: it stands in the cloud of one keyframe, at least two of the five
/// keyframes about the other one saw through it, more than twice as many as saw a surface, the
/// other one's cloud has nothing within 0.3 m, and its own session mostly saw a surface there. So
/// what moves does not count, nor the noise of one keyframe. The larger share of both directions;
/// empty where fewer than 200 points were observed in both. O(points x images of 24 keyframes).
/// Thread safe.
[[nodiscard]] std::optional<double> changed_share(const KeyframeClouds& clouds, const Visit& match,
                                                  const Visit& query, const Pose& T_match_query);

}  // namespace unimapper::merge
