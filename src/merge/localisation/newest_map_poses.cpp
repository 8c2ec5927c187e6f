#include "newest_map_poses.hpp"

#include <optional>
#include <stdexcept>
#include <utility>

#include "localisation_filter.hpp"
#include "src/merge/graph/map_graph.hpp"
#include "src/merge/sessions/session_path.hpp"

namespace unimapper::merge {
namespace {

/// A loop from one keyframe of a session to a place that was known before.
struct Support {
  std::size_t keyframe = 0;  ///< of the session
  UncertainPose at;          ///< of the keyframe in the map, by the loop
};

/// Collects, of each session, its loops and the latest of them.
class Supports {
 public:
  Supports(const MergeResult& result, std::size_t sessions)
      : result_(result), latest_(sessions), count_(sessions, 0) {
    for (const LoopConstraint& loop : result.loops) {
      if (!loop.decision.accepted) continue;
      if (loop.is_intra_session()) {
        take(loop.query.keyframe > loop.match.keyframe ? loop : flipped(loop));
      } else {
        take(loop);
        take(flipped(loop));
      }
    }
  }

  [[nodiscard]] const std::optional<Support>& latest(std::size_t session) const {
    return latest_[session];
  }
  [[nodiscard]] std::size_t count(std::size_t session) const { return count_[session]; }

 private:
  /// A loop whose query is the keyframe that it supports.
  void take(const LoopConstraint& loop) {
    const std::size_t session = loop.query.session;
    ++count_[session];
    std::optional<Support>& latest = latest_[session];
    if (latest && latest->keyframe >= loop.query.keyframe) return;
    const MergedSession& match = result_.sessions[loop.match.session];
    latest =
        Support{loop.query.keyframe, pose_by_loop(match.T_map_keyframe[loop.match.keyframe], loop)};
  }

  const MergeResult& result_;
  std::vector<std::optional<Support>> latest_;  // by session
  std::vector<std::size_t> count_;              // by session
};

MapPose outside_of_the_map(const MergedSession& merged) {
  MapPose at;
  at.state = merged.status == SessionStatus::kProvisional ? LocalisationState::kAmbiguous
                                                          : LocalisationState::kNotYet;
  at.reason = merged.reason;
  return at;
}

MapPose newest_in_the_map(const SessionData& session, const MergedSession& merged,
                          const SessionPath& path, const std::optional<Support>& support) {
  const std::size_t newest = session.keyframes.size() - 1;
  MapPose at;
  at.state = LocalisationState::kLocalised;
  at.T_map_keyframe = merged.T_map_keyframe[newest];
  at.T_map_odometry = at.T_map_keyframe * session.keyframes[newest].T_odometry_keyframe.inverse();
  at.path_m = path.length_m();
  at.since_loop_m = at.path_m;
  MapPoseFilter filter;
  filter.start(0, {merged.T_map_keyframe[0]});
  at.covariance = filter.predict(newest, path).covariance;
  if (!support) return at;
  at.since_loop_m = at.path_m - path.path_m(support->keyframe);
  filter.start(support->keyframe, support->at);
  const Matrix6d by_loop = filter.predict(newest, path).covariance;
  const bool is_surer =
      by_loop.topLeftCorner<3, 3>().trace() < at.covariance.topLeftCorner<3, 3>().trace();
  if (merged.status != SessionStatus::kCentral || is_surer) at.covariance = by_loop;
  return at;
}

void check_result(const std::vector<SessionData>& sessions, const MergeResult& result) {
  bool fits = result.sessions.size() == sessions.size();
  for (std::size_t s = 0; fits && s < sessions.size(); ++s) {
    fits = result.sessions[s].T_map_keyframe.size() == sessions[s].keyframes.size();
  }
  if (!fits) throw std::invalid_argument("the poses are of other sessions");
}

}  // namespace

std::vector<MapPose> newest_map_poses(const std::vector<SessionData>& sessions,
                                      const MergeResult& result,
                                      const OdometryNoiseConfig& odometry) {
  check_result(sessions, result);
  const Supports supports(result, sessions.size());
  std::vector<MapPose> newest;
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    const MergedSession& merged = result.sessions[s];
    if (!is_in_map(merged.status) || sessions[s].keyframes.empty()) {
      newest.push_back(outside_of_the_map(merged));
      continue;
    }
    const SessionPath path = odometry_of(sessions[s], odometry).with_drift(merged.drift_scale);
    newest.push_back(newest_in_the_map(sessions[s], merged, path, supports.latest(s)));
    newest.back().loops = supports.count(s);
  }
  return newest;
}

}  // namespace unimapper::merge
