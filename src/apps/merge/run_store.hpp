// Runs in stores, from which cells are read when they are needed.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <vector>

#include "ports/store/session_import.hpp"
#include "unimapper/wire/receiver.hpp"

namespace unimapper::apps {

/// What a run folder or an event log held.
struct ImportedRun {
  std::vector<store::ImportedSession> sessions;
  wire::ReceiverCounters counters;             ///< of its messages
  std::map<SessionId, std::uint64_t> damaged;  ///< keyframes that it holds damaged only
};

/// Writes the sessions of a run folder or an event log into a store, in the transaction that is
/// open. The session of a run folder gets the folder's name. Damage of the log is reported on
/// stderr. Throws std::runtime_error for what is no run, and what a store or a log throws.
ImportedRun import_run(store::Database& database, const std::filesystem::path& run);

/// Writes a run into a new store in `folder` that does not outlive a power failure: one file, to be
/// read by whoever opens it before it is removed. Throws as `import_run`.
ImportedRun make_run_store(const std::filesystem::path& run, const std::filesystem::path& folder);

/// Whether a session is that of a run, or a later one of it: RUN, RUN.2, RUN.3, ...
[[nodiscard]] bool is_of_run(const std::string& session, const std::string& run);

}  // namespace unimapper::apps
