// Figures of a merge.
#include "src/apps/report/summary.hpp"

#include <algorithm>

#include "unimapper/merge/export.hpp"

namespace unimapper::apps {
namespace {

using evaluate::StampedPose;

/// The session's sensor poses in the map frame, one per scan.
std::vector<StampedPose> sensor_poses(const SessionData& session,
                                      const merge::MergedSession& merged) {
  std::vector<StampedPose> poses;
  for (const merge::TrajectoryPose& pose : merge::session_trajectory(session, merged)) {
    poses.push_back({pose.stamp_ns, pose.T_map_sensor});
  }
  return poses;
}

SessionSummary summarize_session(const SessionData& session, const merge::MergedSession& merged) {
  SessionSummary s;
  s.name = session.info.name;
  s.sensor = session.info.sensor;
  s.status = merged.status;
  s.reason = merged.reason;
  s.keyframes = session.keyframes.size();
  s.missing = session.keyframes_missing;
  s.damaged = session.keyframes_damaged;
  s.complete = session.complete;
  std::uint64_t dynamic = 0;
  for (const KeyframeRecord& keyframe : session.keyframes) {
    s.points_in += keyframe.points_in;
    s.up_known += keyframe.up.known ? 1 : 0;
    s.odometry_contradicted += keyframe.odometry_contradicted ? 1 : 0;
    dynamic += keyframe.points_dynamic;
  }
  if (s.points_in > 0) {
    s.dynamic_share = static_cast<double>(dynamic) / static_cast<double>(s.points_in);
  }
  for (std::size_t k = 1; k < merged.T_map_keyframe.size(); ++k) {
    s.path_m +=
        (merged.T_map_keyframe[k].translation - merged.T_map_keyframe[k - 1].translation).norm();
  }
  return s;
}

/// The reason of a single loop without its figure: "overlap 0.41 (limit 0.45)" is "overlap (limit
/// 0.45)", so that equal reasons add up.
std::string kind_of(const std::string& reason) {
  const std::size_t begin = reason.find_first_of("0123456789");
  if (begin == std::string::npos || reason.find(" (limit ") == std::string::npos) return reason;
  std::size_t end = std::min(reason.find_first_not_of("0123456789.", begin), reason.size());
  if (end < reason.size() && reason[end] == ' ') ++end;
  return reason.substr(0, begin) + reason.substr(end);
}

void count_loops(const merge::MergeResult& result, Summary& summary) {
  for (const merge::LoopConstraint& loop : result.loops) {
    const auto pair = std::minmax(loop.query.session, loop.match.session);
    LoopCount& total = pair.first == pair.second ? summary.intra : summary.inter;
    LoopCount& of_pair = summary.loops_by_pair[{pair.first, pair.second}];
    ++(loop.decision.accepted ? total.accepted : total.refused);
    ++(loop.decision.accepted ? of_pair.accepted : of_pair.refused);
    ++(loop.decision.accepted ? summary.acceptance_ways
                              : summary.refusals)[kind_of(loop.decision.reason)];
  }
}

/// Errors of every merged session with a truth, once the central one has fixed the frame.
void measure_errors(const ReportInput& input, Summary& summary) {
  const merge::MergeResult& result = *input.result;
  const std::size_t central = result.central_session;
  if (input.references.size() != summary.sessions.size() || central >= summary.sessions.size()) {
    return;
  }
  const auto pairs_of = [&](std::size_t s) {
    return evaluate::associate(sensor_poses((*input.sessions)[s], result.sessions[s]),
                               input.references[s].truth);
  };
  const auto central_pairs = pairs_of(central);
  if (central_pairs.empty()) return;
  summary.has_truth = true;
  const Pose T_truth_map = evaluate::align(central_pairs).T_truth_estimate;
  const Pose T_map_truth = T_truth_map.inverse();
  for (std::size_t s = 0; s < summary.sessions.size(); ++s) {
    SessionSummary& session = summary.sessions[s];
    if (!merge::is_in_map(session.status)) continue;
    for (const StampedPose& pose : input.references[s].truth) {
      session.truth_in_map.push_back(T_map_truth * pose.T_world_sensor.translation);
    }
    const auto pairs = pairs_of(s);
    if (pairs.empty()) continue;
    session.error = evaluate::trajectory_error(pairs, T_truth_map);
    double travelled = 0.0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      if (i > 0) {
        travelled += (pairs[i].truth.translation - pairs[i - 1].truth.translation).norm();
      }
      const Eigen::Vector3d error =
          T_truth_map * pairs[i].estimate.translation - pairs[i].truth.translation;
      session.error_along_path_m.emplace_back(travelled, error.norm());
    }
  }
}

}  // namespace

Summary summarize(const ReportInput& input) {
  Summary summary;
  for (std::size_t s = 0; s < input.sessions->size(); ++s) {
    const merge::MergedSession& merged = input.result->sessions.at(s);
    summary.sessions.push_back(summarize_session((*input.sessions)[s], merged));
    summary.merged_sessions += merge::is_in_map(merged.status) ? 1 : 0;
    if (s < input.references.size()) {
      summary.sessions.back().stats = read_run_stats(input.references[s].run);
    }
  }
  count_loops(*input.result, summary);
  measure_errors(input, summary);
  return summary;
}

}  // namespace unimapper::apps
