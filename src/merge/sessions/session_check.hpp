// Plausibility checks of sessions before a merge.
#pragma once

#include <vector>

#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/merge/user_statements.hpp"

namespace unimapper::merge {

/// Throws std::invalid_argument with a sentence for the first session that cannot be merged: a name
/// that is no file name or is taken, keyframes out of order, invalid poses, no reference scan.
void check_sessions(const std::vector<SessionData>& sessions);

/// Throws std::invalid_argument where a statement is about what is not there.
void check_statements(const UserStatements& statements, const std::vector<SessionData>& sessions);

}  // namespace unimapper::merge
