// Results of a merge in words
#pragma once

#include "src/core/cholesky.hpp"
#include "tests/test.hpp"
#include "unimapper/merge/merger.hpp"
#include "words.hpp"

namespace unimapper::regression {

/// Standard deviations of the six axes and their correlations.
inline std::string information_text(const merge::Matrix6d& information) {
  const merge::Matrix6d covariance = Cholesky<6>(information).inverse();
  std::string text = "sigmas";
  for (int i = 0; i < 6; ++i) text += " " + rough(std::sqrt(covariance(i, i)));
  text += " correlations";
  for (int row = 0; row < 6; ++row) {
    for (int column = row + 1; column < 6; ++column) {
      text += " " + fixed(covariance(row, column) /
                              std::sqrt(covariance(row, row) * covariance(column, column)),
                          2);
    }
  }
  return text;
}

inline std::string keyframe_id_text(KeyframeId id) {
  return count(id.session) + ":" + count(id.keyframe);
}

inline std::string loop_text(const merge::LoopConstraint& loop) {
  std::string text =
      line_of("loop", keyframe_id_text(loop.query), "to", keyframe_id_text(loop.match),
              loop.decision.accepted ? "accepted:" : "refused:", loop.decision.reason, "confidence",
              loop.confidence, "overlap", loop.overlap) +
      "  " + pose_text(loop.T_match_query) + "\n";
  return text + "  " + information_text(loop.information) + "\n";
}

inline std::string refined_text(const SessionData& session, const merge::MergedSession& merged) {
  std::string text;
  for (std::size_t k = 0; k < merged.refined.size(); ++k) {
    const KeyframeRecord& keyframe = session.keyframes[k];
    const std::vector<std::uint32_t>& changed = merged.refined[k].changed;
    const auto first_dynamic =
        std::lower_bound(changed.begin(), changed.end(), keyframe.static_cells.size());
    text += line_of("  refined", k, "static", keyframe.static_cells.size(), "of these now dynamic",
                    first_dynamic - changed.begin(), "dynamic", keyframe.dynamic_cells.size(),
                    "of these now static", changed.end() - first_dynamic);
  }
  return text;
}

inline std::string merge_text(const std::vector<SessionData>& sessions,
                              const merge::MergeResult& result) {
  std::string text = line_of("central", result.central_session);
  for (std::size_t s = 0; s < result.sessions.size(); ++s) {
    const merge::MergedSession& merged = result.sessions[s];
    text += line_of("session", sessions[s].info.name, merge::status_name(merged.status),
                    merged.reason) +
            "  anchor " + pose_text(merged.T_map_session) + "\n";
    for (const Pose& pose : merged.T_map_keyframe) text += "  keyframe " + pose_text(pose) + "\n";
    text += refined_text(sessions[s], merged);
  }
  for (const auto& loop : result.loops) text += loop_text(loop);
  text += "graph edges " + count(result.graph_edges.size()) + "\n";
  for (const auto& edge : result.graph_edges) text += "edge of " + loop_text(edge);

  std::map<std::pair<std::uint32_t, std::uint32_t>, CloudMoments> map;
  for (const auto& point : result.map)
    map[{point.session, point.sessions_seen}].add(point.position);
  for (const auto& [key, moments] : map) {
    text += line_of("map of session", key.first, "seen by", key.second, moments);
  }
  std::map<std::pair<std::uint32_t, bool>, CloudMoments> changes;
  for (const auto& change : result.changes) {
    changes[{change.session, change.appeared}].add(change.position);
  }
  for (const auto& [key, moments] : changes) {
    text += line_of("changes of session", key.first, key.second ? "appeared" : "gone", moments);
  }
  CloudMoments dynamic;
  for (const Eigen::Vector3f& point : result.dynamic_points) dynamic.add(point);
  return text + "dynamic " + dynamic.text() + "\n";
}

}  // namespace unimapper::regression
