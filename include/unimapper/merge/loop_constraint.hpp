// Loop constraint between two keyframes, and the decision on it.
#pragma once

#include <string>

#include "unimapper/core/ids.hpp"
#include "unimapper/merge/pose_graph.hpp"

namespace unimapper::merge {

/// Whether a loop, or a set of loops, is accepted.
struct LoopDecision {
  bool accepted = false;  ///< the outcome
  /// Why it was refused. Of an accepted loop empty, or, in `MergeResult`, how it was found:
  /// "descriptor", "radius" or "linked by a person".
  std::string reason;
};

/// Second stage of a loop: a `LoopCandidate` after registration, between levelled keyframe frames.
struct LoopConstraint {
  KeyframeId query;    ///< the keyframe that was searched for
  KeyframeId match;    ///< the keyframe that was found
  Pose T_match_query;  ///< the query's levelled frame to the match's, metres
  Matrix6d information = Matrix6d::Identity();  ///< as in PoseGraph::Edge with from = match
  double overlap = 0.0;                         ///< share of structure that coincides, [0, 1]
  float confidence = 0.0F;  ///< of the descriptor search; of a radius search the overlap
  LoopDecision decision;    ///< of the latest stage that checked the loop
  bool by_person = false;   ///< a person's word: acceptance rules do not apply

  /// True if both keyframes belong to one session.
  [[nodiscard]] bool is_intra_session() const { return query.session == match.session; }
};

}  // namespace unimapper::merge
