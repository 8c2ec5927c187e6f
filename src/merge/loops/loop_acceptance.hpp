// Pairwise-consistent sets of loops (maximum clique on cycle errors).
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "src/merge/sessions/session_path.hpp"
#include "unimapper/merge/alignment.hpp"
#include "unimapper/merge/loop_constraint.hpp"
#include "unimapper/merge/merge_config.hpp"

namespace unimapper::merge {

struct PlacementEvidence;

/// Largest set of pairwise consistent loops of two sessions, or of one.
struct ConsistencySet {
  PairState state = PairState::kRefused;  ///< confirmed: the inliers may enter the pose graph
  std::string reason;                     ///< why it is not confirmed, empty otherwise
  std::vector<std::size_t> inliers;       ///< ascending indices into the loops given
  std::size_t distinct = 0;               ///< inliers at distinct positions along both paths
  /// Loops at distinct positions in the largest set that contradicts the inliers.
  std::size_t competing = 0;
  /// Refused for nothing but the short path that its loops span: sensor data may confirm it.
  bool is_short = false;
  bool is_one_place = false;        ///< all inliers lie where keyframes see the same structure
  bool is_weak_along_axis = false;  ///< too few inliers know the position along one direction
  /// Ambiguous, and nothing else speaks against it: the sets that compete. Sensor data may exclude
  /// them.
  std::vector<ConsistencySet> competing_sets;
  Pose T_match_session_query_session;  ///< best fit to the inliers (inter-session only)
};

/// Rules for two maps by how far the keyframes of the one that sees farther see: `extent_m`, 0 if
/// unknown. What is 2 m apart in a hall differs as much as what is 5 m apart in a street. No room
/// has a path of 20 m.
[[nodiscard]] AcceptanceConfig scaled_to_extent(AcceptanceConfig config, double extent_m);

/// The consistency set of the inter-session loops of two sessions. It is refused if it is too small
/// or spans too short a path (`is_short`); it is provisional if a competing set is nearly as large,
/// or if too few of its loops know the position along some direction
/// (docs/design/loop-acceptance.md). O(n^2) and a bounded clique search.
ConsistencySet inter_session_consistency(std::span<const LoopConstraint> loops,
                                         const SessionPath& query, const SessionPath& match,
                                         const AcceptanceConfig& config);

/// Why a placement by a confirmed set of loops must wait, by what the sensor data say of it
/// (nothing, if nobody asked them); empty: it need not.
std::string reason_to_wait(const ConsistencySet& set, const PlacementEvidence& evidence,
                           const AcceptanceConfig& config);

/// Whether another loop of the set confirms loop `i`, all within one session: at another place it
/// would contradict this one if it were wrong, because odometry between the two is sure.
bool is_confirmed(std::span<const LoopConstraint> loops, std::span<const std::size_t> set,
                  std::size_t i, const SessionPath& path, const AcceptanceConfig& config);

/// Loops within a session that agree with each other and with odometry under the drift model:
/// ascending indices into the loops given.
struct IntraSessionLoops {
  std::vector<std::size_t> accepted;  ///< another one at another place confirms each
  std::vector<std::size_t> waiting;   ///< nothing confirms them yet
};

/// How many times as far as modelled odometry drifts if the largest set of loops that agree with
/// each other is right, of those within one session that were verified and refused. Exactly 1 where
/// it has too few loops, no more than were accepted, or asks for so much that another place that
/// looks alike is likelier. O(n^2) and a bounded clique search.
double drift_by_refused(std::span<const LoopConstraint> refused, std::size_t accepted,
                        const SessionPath& path, const AcceptanceConfig& config);

/// The consistent loops within one session.
IntraSessionLoops intra_session_consistency(std::span<const LoopConstraint> loops,
                                            const SessionPath& path,
                                            const AcceptanceConfig& config);

/// Rigid fit of one session's frame to another's through their inter-session loops.
Pose fit_session_transform(std::span<const LoopConstraint> loops,
                           std::span<const std::size_t> chosen, const SessionPath& query,
                           const SessionPath& match);

}  // namespace unimapper::merge
