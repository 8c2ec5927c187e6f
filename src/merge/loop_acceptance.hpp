// Pairwise-consistent sets of loops (maximum clique on cycle errors).
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "session_path.hpp"
#include "unimapper/merge/loop_constraint.hpp"
#include "unimapper/merge/merge_config.hpp"

namespace unimapper::merge {

/// Largest set of pairwise consistent loops of two sessions, or of one.
struct ConsistencySet {
  LoopDecision decision;             ///< accepted: the inliers may enter the pose graph
  std::vector<std::size_t> inliers;  ///< ascending indices into the loops given
  std::size_t distinct = 0;          ///< inliers at distinct positions along both paths
  std::size_t competing = 0;         ///< the same for the largest set that contradicts the inliers
  Pose T_match_session_query_session;  ///< best fit to the inliers (inter-session only)
};

/// Pairwise cycle: query odometry, one loop forwards, match odometry, the other loop back. Chi
/// square with 6 degrees of freedom, small if the two loops are consistent. Needs loops of the
/// same two sessions (or all within one session).
double cycle_chi2(const LoopConstraint& a, const LoopConstraint& b, const SessionPath& query,
                  const SessionPath& match);

/// The same rules for two maps of which the keyframes of the one that sees farther see `extent_m`
/// far (0: unknown): what is 2 m apart in a hall differs as much as what is 5 m apart in a street,
/// and there is no path of 20 m in a room.
[[nodiscard]] AcceptanceConfig scaled_to_extent(AcceptanceConfig config, double extent_m);

/// The consistency set of the inter-session loops of two sessions. It is accepted if it is large,
/// spans enough path and exceeds the largest competing set by the configured margin; otherwise the
/// match is ambiguous and nothing is accepted (docs/design/loop-acceptance.md). O(n^2) and a
/// bounded clique search.
ConsistencySet inter_session_consistency(std::span<const LoopConstraint> loops,
                                         const SessionPath& query, const SessionPath& match,
                                         const AcceptanceConfig& config);

/// The consistency set of the loops within one session: of those that also agree with odometry
/// under the drift model.
ConsistencySet intra_session_consistency(std::span<const LoopConstraint> loops,
                                         const SessionPath& path, const AcceptanceConfig& config);

/// Rigid fit of one session's frame to another's through their inter-session loops.
Pose fit_session_transform(std::span<const LoopConstraint> loops,
                           std::span<const std::size_t> chosen, const SessionPath& query,
                           const SessionPath& match);

}  // namespace unimapper::merge
