// Known positions that lie beside runs.
#pragma once

#include <filesystem>
#include <vector>

#include "src/apps/map/projection.hpp"
#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/merge/user_statements.hpp"

namespace unimapper::apps {

/// The runs' files of positions (`kPositionsFile`) that are there.
[[nodiscard]] std::vector<std::filesystem::path> position_files(
    const std::vector<std::filesystem::path>& runs);

/// Positions of keyframes from the files in the sessions' `runs`, in a coordinate system. Throws
/// std::runtime_error for a wrong file, or without any position.
[[nodiscard]] std::vector<merge::KnownPosition> positions_of_runs(
    const std::vector<SessionData>& sessions, const std::vector<std::filesystem::path>& runs,
    const Projection& system);

/// How many positions were used, and why others were not, on stderr.
void report_positions(const merge::MergeResult& result, const std::vector<SessionData>& sessions);

}  // namespace unimapper::apps
