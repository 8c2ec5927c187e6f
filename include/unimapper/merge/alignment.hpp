// Alignment of several sessions through loops: joint pose graph optimisation with anchor nodes.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "unimapper/core/keyframe.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/merge/loop_constraint.hpp"
#include "unimapper/merge/merge_config.hpp"
#include "unimapper/merge/user_statements.hpp"

namespace unimapper::merge {

/// Refused: there is no set of loops that could connect the maps. Provisional: there is one, and
/// something else would explain it as well; the maps stay apart until more is known. Confirmed:
/// the maps are merged.
enum class PairState : std::uint8_t { kRefused, kProvisional, kConfirmed };

/// "refused", "provisional" or "confirmed": the word in summary.json.
[[nodiscard]] const char* state_name(PairState state);

/// What is known of two sessions with verified inter-session loops.
struct PairOutcome {
  std::size_t match = 0;                  ///< the session with the lower index
  std::size_t query = 0;                  ///< the session with the higher index
  PairState state = PairState::kRefused;  ///< whether they are merged
  std::string reason;                     ///< why it is not confirmed, empty otherwise
  std::size_t loops = 0;                  ///< between the two sessions, verified by registration
  std::size_t distinct = 0;  ///< loops at distinct positions in the largest consistent set
  /// Loops at distinct positions in the largest set that contradicts the consistent one.
  std::size_t competing = 0;
  /// Where the consistent set places the query's odometry frame in the match's, metres. The
  /// identity without such a set.
  Pose T_match_session_query_session;
};

/// One session to align. No sensor data: any front end can feed the aligner.
struct AlignmentSession {
  std::vector<Pose> T_odometry_keyframe;  ///< by keyframe: keyframe frame to odometry frame, metres
  double central_score = 0.0;             ///< suitability as the central map; larger is better
  /// How far its keyframes see, metres (`AcceptanceConfig::kFullExtentM`); 0: unknown, far.
  double extent_m = 0.0;
  /// Before keyframes and score: the session with the largest becomes the central map.
  int central_priority = 0;
  std::vector<KnownPosition> positions{};         ///< of its keyframes; at most one of each
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< in its odometry frame, of length one
  /// By keyframe, since the one before (`KeyframeContent::slip`); empty: none.
  std::vector<SlipCovariance> slips{};
};

/// The state of all maps after alignment.
struct Alignment {
  std::size_t central = 0;          ///< index of the session whose frame is the map's
  std::vector<bool> connected;      ///< false: in its own frame
  std::vector<std::string> reason;  ///< why a session is not connected
  std::vector<Pose> T_map_session;  ///< anchor nodes
  std::vector<std::vector<Pose>> T_session_keyframe;  ///< optimised, in the session's own frame
  std::vector<LoopDecision> decisions;                ///< on the loops given, in their order
  std::vector<PairOutcome> pairs;  ///< of sessions with inter-session loops, by match, then query
  /// How many times as far as `MergeConfig::odometry` says the odometry of each session drifts, by
  /// its loops with others; at least 1, and exactly 1 where fewer than six sessions tell.
  std::vector<double> drift_scale;
  std::vector<PositionOutcome> positions;  ///< of all sessions, in their order
  std::optional<Pose> T_map_site{};        ///< the site frame, if connected sessions have positions
  double heading_information = 0.0;        ///< of the positions used, 1 / radians squared

  /// Pose of a keyframe in the map frame.
  [[nodiscard]] Pose T_map_keyframe(KeyframeId k) const {
    return T_map_session[k.session] * T_session_keyframe[k.session][k.keyframe];
  }
};

/// What sensor data say about two sessions that a set of loops places in one frame.
struct PlacementEvidence {
  std::size_t supporting = 0;     ///< keyframes beside each other that fit
  std::size_t contradicting = 0;  ///< keyframes beside each other that see different structure
  std::string aliasing;           ///< where else the query fits as well, in words; empty: nowhere
  std::size_t competing_excluded = 0;  ///< competing placements that the data speak against
};

/// How far from a placement the known positions of both sessions exclude any other; infinite where
/// they say nothing. Metres.
struct ExcludedBeyond {
  double horizontal_m = std::numeric_limits<double>::infinity();  ///< any way along the ground
  double vertical_m = std::numeric_limits<double>::infinity();    ///< up or down

  /// Whether a placement that differs by so much is excluded.
  [[nodiscard]] bool excludes(const Eigen::Vector3d& shift) const {
    return shift.head<2>().norm() > horizontal_m || std::abs(shift.z()) > vertical_m;
  }
};

/// A set of loops that contradicts a placement.
struct CompetingPlacement {
  std::vector<LoopConstraint> loops;   ///< consistent with each other
  Pose T_match_session_query_session;  ///< where the loops would put the query
};

/// Two sessions, each with its poses corrected by its intra-session loops, and where inter-session
/// loops, which are not empty, place the query.
struct Placement {
  std::span<const LoopConstraint> loops;           ///< the consistency set
  std::span<const Pose> T_query_session_keyframe;  ///< of the query, in its odometry frame
  std::span<const Pose> T_match_session_keyframe;  ///< of the match, in its odometry frame
  Pose T_match_session_query_session;              ///< odometry frame to odometry frame, metres
  ExcludedBeyond beyond{};                         ///< what positions exclude
  /// The pair is ambiguous unless the data speak against each.
  std::span<const CompetingPlacement> competing{};
  /// The loops span too short a path to be trusted unless walls fit.
  bool is_short = false;
};

/// Evaluates a placement by sensor data.
using PlacementCheck = std::function<PlacementEvidence(const Placement& placement)>;

/// Optimises every session with its intra-session loops (paper section V-C), finds the consistency
/// set of every pair of sessions, from six sessions on with the drift that these say, asks `check`
/// about those that connect sessions, then joins
/// pairs of sessions, strongest first, starting from the central map (section VI), the first ones
/// one by one, later ones in batches. Without a check, loops that lie in one place leave a pair
/// provisional. Every join is a transaction: it is optimised, outliers are rejected, and it is
/// rolled back if its loops do not survive or if it deforms a map more than its odometry could
/// explain. Sessions that no accepted set of loops connects stay apart. Positions that agree with
/// their session are part of every optimisation; loops that contradict those of both sessions are
/// refused. Deterministic. Throws std::invalid_argument for a loop or a position of a keyframe that
/// does not exist.
Alignment align_sessions(const std::vector<AlignmentSession>& sessions,
                         std::span<const LoopConstraint> loops, const MergeConfig& config,
                         const PlacementCheck& check = {});

/// Adds loops found between and within sessions that `align_sessions` has connected (radius
/// search), rejects outliers, lets those within a session wait that no other confirms, readmits
/// loops that were rejected or wait and agree with the result, and optimises once more. `loops` are
/// all loops, the earlier ones first. Of those among connected sessions the loops that agree with
/// the result are accepted, and no others. If the result is implausible, or there is none, `start`
/// is kept and the new loops are rejected.
Alignment refine_alignment(const Alignment& start, const std::vector<AlignmentSession>& sessions,
                           std::span<const LoopConstraint> loops, const MergeConfig& config);

}  // namespace unimapper::merge
