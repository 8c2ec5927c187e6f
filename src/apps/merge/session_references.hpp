// Ground truth and run folders of sessions, for the report of a map.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "src/apps/report.hpp"
#include "unimapper/core/keyframe_record.hpp"

namespace CLI {
class App;
}

namespace unimapper::apps {

/// What the user names for sessions.
struct ReferenceOptions {
  std::vector<std::pair<std::string, std::filesystem::path>> truths;  ///< session, dataset
  /// Run folders of sessions without one, by their names: stage times and labels are read from
  /// them.
  std::vector<std::filesystem::path> stats;
};

/// Adds --truth and --stats to a command.
void add_reference_options(CLI::App& command, ReferenceOptions& options);

/// Ground truth, run folder and removal scores, one of each session. `runs`: run folders as far as
/// they are known. Throws std::runtime_error where a truth names a session that is not there.
[[nodiscard]] std::vector<SessionReference> gather_references(
    const ReferenceOptions& options, const std::vector<SessionData>& sessions,
    const std::vector<std::filesystem::path>& runs);

}  // namespace unimapper::apps
