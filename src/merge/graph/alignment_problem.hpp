// Sessions, loops and the current estimate of an alignment.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "map_graph.hpp"
#include "session_site.hpp"
#include "unimapper/merge/alignment.hpp"

namespace unimapper::merge {

// Reasons of refusal that more than one step gives.
inline constexpr const char* kOutsideConsistencySet =
    "outside the consistency set of its two sessions";
inline constexpr const char* kWaits = "waits for another loop of the session that confirms it";
inline constexpr const char* kNoSolution = "the pose graph found no solution";
inline constexpr const char* kDisagreesWithMap = "disagrees with the merged maps";
inline constexpr const char* kContradictsPositions = "contradicts the known positions";
inline constexpr const char* kImplausibleDeformation =
    "the maps would deform more than odometry allows";

/// What the steps of an alignment share: inputs, decisions so far, and the poses.
class AlignmentProblem {
 public:
  /// Throws std::invalid_argument for a loop to a keyframe that does not exist.
  AlignmentProblem(const std::vector<AlignmentSession>& all_sessions,
                   std::span<const LoopConstraint> all_loops, const MergeConfig& merge_config);

  [[nodiscard]] std::vector<LoopConstraint> select(std::span<const std::size_t> indices) const;

  /// Optimises with the chosen loops and the positions in use, removes those whose residual exceeds
  /// the gate, and repeats until none does. Trials of many sessions move keyframes with loops alone
  /// and stop early. False if the solver failed.
  bool optimize_rejecting_outliers(MapState& trial, std::span<const std::size_t> which_sessions,
                                   std::vector<std::size_t>& chosen,
                                   Variables variables = Variables::kAllKeyframes) const;

  /// No session deforms more from the current state to `after` than its odometry's drift explains.
  [[nodiscard]] bool all_plausible(const MapState& after,
                                   std::span<const std::size_t> which_sessions) const;

  /// The odometry of a session drifts so many times as far as the configuration says.
  void set_drift(std::size_t session, double scale);

  [[nodiscard]] Alignment result() const;

  const MergeConfig& config;
  const std::vector<AlignmentSession>& sessions;
  std::vector<LoopConstraint> loops;  ///< inter-session loops with the lower session as match
  std::vector<LoopDecision> decisions;
  std::vector<std::string> reasons;  ///< by session: why it is not connected
  std::vector<PairOutcome> pairs;
  MapState state;
  std::vector<double> drift_scale;                ///< by session, in `state.odometry` already
  std::vector<std::optional<SessionSite>> sites;  ///< by session, of those with positions
  std::vector<PositionOutcome> rejected;          ///< positions that no step may use

 private:
  [[nodiscard]] std::vector<PositionOutcome> position_outcomes() const;
};

}  // namespace unimapper::merge
