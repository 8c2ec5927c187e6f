#include "src/apps/view/shown_merge.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

namespace unimapper::apps {
namespace {

/// Poses of all keyframes: those that the merge had none of follow by odometry.
std::vector<Pose> all_poses(const SessionData& session, const std::vector<std::uint32_t>& merged,
                            const std::vector<Pose>& T_map_keyframe) {
  std::vector<Pose> poses;
  Pose T_map_odometry;
  for (const KeyframeRecord& keyframe : session.keyframes) {
    const auto found = std::lower_bound(merged.begin(), merged.end(), keyframe.sequence);
    if (found != merged.end() && *found == keyframe.sequence) {
      poses.push_back(T_map_keyframe[static_cast<std::size_t>(found - merged.begin())]);
      T_map_odometry = poses.back() * keyframe.T_odometry_keyframe.inverse();
    } else {
      poses.push_back(T_map_odometry * keyframe.T_odometry_keyframe);
    }
  }
  return poses;
}

}  // namespace

merge::MergeResult grown_result(const store::MapResult& stored, const KeyframeRows& rows) {
  merge::MergeResult result = posed_result(stored, rows);
  for (const store::SessionResult& session : stored.sessions) {
    const std::size_t s = *rows.index(session.session);
    result.sessions[s].T_map_keyframe =
        all_poses(rows.sessions()[s], session.sequences, session.T_map_keyframe);
  }
  return result;
}

void place_by_odometry(const std::vector<SessionData>& sessions, merge::MergeResult& result) {
  result.sessions.resize(sessions.size());
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    merge::MergedSession& merged = result.sessions[s];
    if (merged.T_map_keyframe.size() == sessions[s].keyframes.size()) continue;
    merged.T_map_keyframe = all_poses(sessions[s], {}, {});
    merged.reason = "not merged yet";
  }
}

SessionData without_descriptors(const SessionData& session) {
  SessionData light;
  light.info = session.info;
  light.complete = session.complete;
  light.keyframes_missing = session.keyframes_missing;
  light.keyframes_damaged = session.keyframes_damaged;
  light.contents = session.contents;
  light.keyframes.reserve(session.keyframes.size());
  for (const KeyframeRecord& keyframe : session.keyframes) {
    KeyframeRecord& kept = light.keyframes.emplace_back();
    kept.session = keyframe.session;
    kept.sequence = keyframe.sequence;
    kept.T_odometry_keyframe = keyframe.T_odometry_keyframe;
    kept.up = keyframe.up;
    kept.is_summary = keyframe.is_summary;
    kept.cell_size_m = keyframe.cell_size_m;
    kept.scans = {keyframe.scans[keyframe.reference_scan]};
  }
  return light;
}

void mark_forbidden(const store::ProjectState& state, const KeyframeRows& rows,
                    const std::vector<merge::LoopConstraint>& loops,
                    nlohmann::ordered_json& described) {
  std::set<std::pair<store::KeyframeRow, store::KeyframeRow>> forbidden;
  for (const store::StoredStatement& statement : state.statements) {
    if (statement.kind != store::StatementKind::kForbidden) continue;
    forbidden.insert(std::minmax(statement.match, statement.query));
  }
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const store::KeyframeRow match = rows.row(loops[i].match);
    const store::KeyframeRow query = rows.row(loops[i].query);
    if (forbidden.count(std::minmax(match, query)) > 0) described[i]["statement"] = "wrong";
  }
}

}  // namespace unimapper::apps
