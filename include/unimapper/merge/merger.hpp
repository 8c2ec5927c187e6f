// Merging of any number of sessions into one map.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "unimapper/core/changed_object.hpp"
#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/merge/alignment.hpp"
#include "unimapper/merge/external_vector.hpp"
#include "unimapper/merge/loop_constraint.hpp"
#include "unimapper/merge/loop_outcomes.hpp"
#include "unimapper/merge/merge_config.hpp"
#include "unimapper/merge/refinement.hpp"
#include "unimapper/merge/user_statements.hpp"

namespace unimapper::merge {

/// Provisional: a set of loops connects the session to another one, and something else would
/// explain it as well (`MergeResult::pairs`); it stays apart until more is known. Unconnected:
/// nothing connects it.
enum class SessionStatus { kCentral, kMerged, kProvisional, kUnconnected };

/// "central", "merged", "provisional" or "unconnected": the word in summary.json.
[[nodiscard]] const char* status_name(SessionStatus status);

/// Whether a session of that status is part of the unified map.
[[nodiscard]] constexpr bool is_in_map(SessionStatus status) {
  return status == SessionStatus::kCentral || status == SessionStatus::kMerged;
}

/// One session in the unified frame. A session that is not in the map keeps all its keyframes, in
/// its own frame: `T_map_session` is the identity then.
struct MergedSession {
  SessionStatus status = SessionStatus::kUnconnected;  ///< whether it is connected to the map
  /// Why it is not connected, what is wrong with its odometry, or where its positions are unsure;
  /// else empty.
  std::string reason;
  Pose T_map_session;                ///< the anchor node: session odometry frame to the map frame
  std::vector<Pose> T_map_keyframe;  ///< by keyframe: levelled keyframe frame to map frame, metres
  std::vector<RefinedKeyframe> refined;  ///< refined labels, by keyframe
  /// By keyframe the standard deviation of its position along the horizontal axis that is known
  /// least, metres, relative to the central session as a whole, by odometry and accepted loops.
  /// Only of a whole map, and of sessions in it.
  std::vector<double> position_sigma_m;
  /// How many times as far as assumed its odometry drifts: `Alignment::drift_scale`, or what the
  /// session's own loops say that were refused because they contradict it; not stored.
  double drift_scale = 1.0;
};

/// A point of the unified map.
struct MapPoint {
  Eigen::Vector3f position;   ///< map frame, metres
  std::uint32_t session = 0;  ///< index of the first session that saw it
  /// How many sessions saw it. With the bits behind it, since maps are files of these.
  std::uint32_t sessions_seen : 23 = 0;
  std::uint32_t is_ground : 1 = 0;  ///< most of its cells are ground
  std::uint32_t intensity : 8 = 0;  ///< mean of its cells, from 1; 0: not known
};

/// A point of one session where another session observed free space.
struct ChangedPoint {
  Eigen::Vector3f position;   ///< map frame, metres
  std::uint32_t session = 0;  ///< index of the session in which the point exists
  bool appeared = false;      ///< true: new in `session`; false: gone after `session`
  std::uint32_t object = 0;   ///< index of the changed object it is a part of
};

/// Points of one session that changed together. Moved: something of the same size is gone beside
/// it.
struct ChangedObject {
  ChangeKind kind = ChangeKind::kAppeared;  ///< what became of it
  std::uint32_t session = 0;  ///< index of the session in which it exists; moved: of the later one
  std::uint32_t free_in = 0;  ///< index of the session that observed free space there
  UprightBox box;             ///< around its points, map frame
  std::optional<UprightBox> before{};  ///< moved: its box in the earlier session
  std::uint32_t voxels = 0;            ///< of the map that it takes
  /// Of its voxels of which the other session knows anything the share that changed, in (0, 1].
  double confidence = 0.0;
  /// Share of the observations by its own session that saw through it: small where it stood still.
  double seen_through = 0.0;
};

/// Wall-clock time of one stage.
struct StageTime {
  std::string stage;     ///< name of the stage
  double seconds = 0.0;  ///< how long it took
};

/// Everything a merge finds: trajectories, loops, map and changes.
struct MergeResult {
  std::size_t central_session = 0;      ///< whose frame is the map's, but for its tilt
  std::vector<MergedSession> sessions;  ///< by index of the session
  /// All loops considered, verified or not, with the final decision on each.
  std::vector<LoopConstraint> loops;
  std::vector<PairOutcome> pairs;  ///< of sessions with inter-session loops, by match, then query
  std::vector<PositionOutcome> positions;          ///< of all known positions, by session
  std::optional<Georeference> georeference{};      ///< of the map frame; none: no position was used
  ExternalVector<MapPoint> map;                    ///< static points, the unified map
  std::vector<ChangedPoint> changes;               ///< points that differ between sessions
  std::vector<ChangedObject> changed_objects;      ///< what these are parts of
  ExternalVector<Eigen::Vector3f> dynamic_points;  ///< what is not static, map frame, for display
  /// The edges of the final pose graph: accepted loops, then odometry (match = from).
  std::vector<LoopConstraint> graph_edges;
  std::vector<StageTime> timing;  ///< the only part that differs from run to run
};

/// Merges any number of sessions (paper section VI). Deterministic: the same sessions give the
/// same result, whatever the number of threads. Throws std::invalid_argument for a session
/// whose data could not be a session (no keyframes is allowed: it stays unconnected). Keyframes
/// from before a robot knew up are taken as they are: `level_keyframes` first. `progress` receives
/// stages and outcomes in words. `statements` are obeyed: a forbidden loop is never accepted, a
/// link is, unless the maps would deform more than odometry allows, a session kept apart stays
/// unconnected, the reference is the central session, and positions take part in the pose graph and
/// place the map in their frame, but for an origin near them (`Georeference`); also throws
/// std::invalid_argument for sessions and keyframes in them that do not exist. What `outcomes` know
/// is not verified again; the result is the same. `scratch`: a folder that exists, for a temporary
/// file with the voxels of the sessions (32 bytes each) and the points of the map, which are in
/// memory otherwise; it lives as long as the result. Throws std::runtime_error where it cannot be
/// written.
[[nodiscard]] MergeResult merge_sessions(
    const std::vector<SessionData>& sessions, const MergeConfig& config = {},
    const std::function<void(const std::string&)>& progress = {},
    const UserStatements& statements = {}, LoopOutcomes* outcomes = nullptr,
    const std::filesystem::path& scratch = {});

/// Merges sessions as `merge_sessions` does, without labels, map, changes and edges of the graph.
/// `complete_merge` makes a whole merge of the result.
[[nodiscard]] MergeResult merge_poses(const std::vector<SessionData>& sessions,
                                      const MergeConfig& config = {},
                                      const std::function<void(const std::string&)>& progress = {},
                                      const UserStatements& statements = {},
                                      LoopOutcomes* outcomes = nullptr);

/// Which sessions' odometry drifts farther than assumed, each after "; "; empty: none.
[[nodiscard]] std::string drift_text(const std::vector<SessionData>& sessions,
                                     const MergeResult& result);

/// The rest of a merge of which central session, status and poses of the sessions, and loops with
/// the final decisions are known: the same result as the merge they are from. Throws
/// std::invalid_argument where the poses do not fit the sessions.
[[nodiscard]] MergeResult complete_merge(
    const std::vector<SessionData>& sessions, MergeResult posed, const MergeConfig& config = {},
    const std::function<void(const std::string&)>& progress = {},
    const std::filesystem::path& scratch = {});

}  // namespace unimapper::merge
