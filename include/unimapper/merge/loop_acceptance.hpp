// Which loops are believed: consistency in groups, never one loop on its own word.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "unimapper/merge/loop_constraint.hpp"
#include "unimapper/merge/merge_config.hpp"
#include "unimapper/merge/session_path.hpp"

namespace unimapper::merge {

/// Verdict on the loops between two maps, or within one.
struct LoopVote {
  bool accepted = false;
  std::string reason;                  ///< why not, empty if accepted
  std::vector<std::size_t> inliers;    ///< ascending indices into the loops voted on
  std::size_t distinct = 0;            ///< inliers at distinct places
  std::size_t second = 0;              ///< distinct inliers of the best disjoint cluster
  Pose T_match_session_query_session;  ///< best fit to the inliers (between two maps only)
};

/// Pairwise cycle: query odometry, one loop forwards, match odometry, the other loop back. Chi
/// square with 6 degrees of freedom; small if the two loops tell the same story. Needs
/// loops of the same two sessions (or all within one session).
double cycle_chi2(const LoopConstraint& a, const LoopConstraint& b, const SessionPath& query,
                  const SessionPath& match);

/// Votes on the loops between two maps: the largest set of pairwise consistent loops wins if it
/// is large, long and ahead of the best disjoint set by the configured margin. Nothing is
/// accepted otherwise (docs/design/loop-acceptance.md). O(n^2) and a bounded clique search.
LoopVote vote_pair(std::span<const LoopConstraint> loops, const SessionPath& query,
                   const SessionPath& match, const AcceptanceConfig& config);

/// Votes on the loops within one session. Odometry itself is a witness here: a loop must agree
/// with the drift model, and the largest consistent set is taken.
LoopVote vote_session(std::span<const LoopConstraint> loops, const SessionPath& path,
                      const AcceptanceConfig& config);

/// Rigid fit of one map to another through loops between them, keyframe frames and all.
Pose fit_session_transform(std::span<const LoopConstraint> loops,
                           std::span<const std::size_t> chosen, const SessionPath& query,
                           const SessionPath& match);

}  // namespace unimapper::merge
