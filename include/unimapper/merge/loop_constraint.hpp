// A measured loop between two keyframes.
#pragma once

#include <cstddef>

#include "unimapper/merge/pose_graph.hpp"

namespace unimapper::merge {

/// A keyframe by its session's index and its own index within the session.
struct KeyframeRef {
  std::size_t session = 0;
  std::size_t keyframe = 0;
  friend auto operator<=>(const KeyframeRef&, const KeyframeRef&) = default;
};

/// A loop that geometry has confirmed, between levelled keyframe frames. What a pair of maps
/// makes of it is decided by `vote_pair`, what a single map makes of it by `vote_session`.
struct LoopConstraint {
  KeyframeRef query;
  KeyframeRef match;
  Pose T_match_query;
  Matrix6d information = Matrix6d::Identity();  ///< as in PoseGraph::Edge with from = match
  double overlap = 0.0;                         ///< share of structure that coincides, [0, 1]
};

}  // namespace unimapper::merge
