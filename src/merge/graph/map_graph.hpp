// Anchor-node pose graph of several sessions.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "src/merge/sessions/session_path.hpp"
#include "unimapper/merge/loop_constraint.hpp"
#include "unimapper/merge/merge_config.hpp"
#include "unimapper/merge/user_statements.hpp"

namespace unimapper::merge {

/// Odometry of all sessions, which never changes, and the current estimate.
struct MapState {
  std::vector<SessionPath> odometry;
  std::vector<std::vector<Pose>> T_session_keyframe;
  std::vector<Pose> T_map_session;
  std::vector<bool> connected;  ///< in the central map's component
  std::size_t central = 0;
  std::vector<Eigen::Vector3d> up;       ///< by session: up in its odometry frame
  std::vector<KnownPosition> positions;  ///< those in use, of all sessions
  std::optional<Pose> T_map_site;        ///< where positions are part of the estimate

  [[nodiscard]] Pose T_map_keyframe(KeyframeId k) const {
    return T_map_session[k.session] * T_session_keyframe[k.session][k.keyframe];
  }
  [[nodiscard]] std::vector<std::size_t> connected_sessions() const;
  /// Both sessions of the loop are connected.
  [[nodiscard]] bool connects(const LoopConstraint& loop) const {
    return connected[loop.query.session] && connected[loop.match.session];
  }
};

/// The initial estimate: every session at its odometry.
MapState make_map_state(std::vector<SessionPath> odometry);

/// A loop with query and match exchanged; its covariance is propagated to first order.
LoopConstraint flipped(const LoopConstraint& loop);

/// Squared whitened residual of a loop at the current estimate, along a free axis bounded by where
/// a right candidate starts (`bounded_by_start`).
double loop_chi2(const MapState& state, const LoopConstraint& loop);

/// More are solved by a method that is faster for thousands of keyframes.
inline constexpr std::size_t kFewSessions = 5;

/// Which poses a solve of many sessions moves.
enum class Variables {
  kAllKeyframes,
  kLoopEnds,  ///< keyframes with loops; those between follow, to first order
};

/// Optimises the given sessions, the loops among them and their positions: central anchor fixed,
/// first pose of every session fixed in its own frame, other anchors free without a prior, the site
/// free but for the map's up. Up to `kFewSessions`, and sessions with positions, are solved with
/// all keyframes, whatever `variables` says. False if the solver failed; the state is unchanged
/// then.
bool optimize_maps(MapState& state, std::span<const std::size_t> sessions,
                   std::span<const LoopConstraint> loops, const GraphConfig& config,
                   Variables variables = Variables::kAllKeyframes);

/// True if no keyframe of `session` moved farther in its own frame than its odometry's drift
/// explains.
bool deformation_is_plausible(const MapState& before, const MapState& after, std::size_t session,
                              const GraphConfig& config);

}  // namespace unimapper::merge
