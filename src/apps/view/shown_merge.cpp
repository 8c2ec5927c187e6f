#include "src/apps/view/shown_merge.hpp"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "unimapper/merge/user_statements.hpp"

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

void mark_forbidden(const std::vector<store::StoredStatement>& statements, const KeyframeRows& rows,
                    const std::vector<merge::LoopConstraint>& loops,
                    nlohmann::ordered_json& described) {
  using Ends = std::pair<store::KeyframeRow, store::KeyframeRow>;
  std::map<Ends, std::size_t> by_ends;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    by_ends.emplace(std::minmax(rows.row(loops[i].match), rows.row(loops[i].query)), i);
  }
  for (const store::StoredStatement& statement : statements) {
    if (statement.kind != store::StatementKind::kForbidden) continue;
    const auto found = by_ends.find(std::minmax(statement.match, statement.query));
    if (found != by_ends.end()) {
      described[found->second]["statement"] = "wrong";
      continue;
    }
    const std::optional<KeyframeId> query = rows.find(statement.query);
    const std::optional<KeyframeId> match = rows.find(statement.match);
    if (!query || !match) continue;
    described.push_back({{"query", {query->session, query->keyframe}},
                         {"match", {match->session, match->keyframe}},
                         {"state", "refused"},
                         {"reason", merge::kForbiddenByPerson},
                         {"overlap", nullptr},
                         {"confidence", nullptr},
                         {"T_match_query", nullptr},
                         {"residual_m", nullptr},
                         {"residual_deg", nullptr},
                         {"weak_axes", 0},
                         {"by_person", false},
                         {"statement", "wrong"}});
  }
}

}  // namespace unimapper::apps
