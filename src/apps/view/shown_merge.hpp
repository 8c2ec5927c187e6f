// Merge in a store as the page shows it, with what has arrived since.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "ports/store/project.hpp"
#include "src/apps/map/stored_result.hpp"
#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/merge/merger.hpp"

namespace unimapper::apps {

/// What the page needs of a session that is held without cells: neither descriptors nor the scans
/// besides the reference scan, which are most of it.
[[nodiscard]] SessionData without_descriptors(const SessionData& session);

/// What a stored merge says of sessions that may have grown since.
[[nodiscard]] merge::MergeResult grown_result(const store::MapResult& stored,
                                              const KeyframeRows& rows);

/// Adds sessions that no merge has seen yet, each in its own frame.
void place_by_odometry(const std::vector<SessionData>& sessions, merge::MergeResult& result);

/// Marks loops that people forbid in `described`, and adds those that are proposed no more, because
/// another pair of keyframes took their place: what was said can be taken back.
void mark_forbidden(const std::vector<store::StoredStatement>& statements, const KeyframeRows& rows,
                    const std::vector<merge::LoopConstraint>& loops,
                    nlohmann::ordered_json& described);

}  // namespace unimapper::apps
