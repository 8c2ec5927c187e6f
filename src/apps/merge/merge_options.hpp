// Options and steps of `unimapper merge`.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "src/apps/merge/session_references.hpp"
#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/merge/export.hpp"

namespace unimapper::apps {

struct MergeOptions {
  std::vector<std::filesystem::path> runs;  ///< run folders, LCM event logs or stores
  std::vector<std::string> chosen;          ///< sessions of stores, by name; empty: all
  std::filesystem::path out;
  ReferenceOptions reference;  ///< of sessions, for the report
  /// Label the scans of sessions with a dataset anew, by what is static after all.
  bool refined_labels = false;
  /// A session that is not connected to the others is no failure.
  bool allow_unconnected = false;
  bool replaces = false;                 ///< overwrite an earlier map
  std::filesystem::path mcap;            ///< the map as a scene; empty: not written
  merge::ExportOptions output;           ///< how much of the map is written
  std::filesystem::path config;          ///< JSON file with parameters that differ from the default
  std::optional<std::uint32_t> threads;  ///< instead of the configuration's
  std::optional<std::uint32_t> memory_mb;  ///< instead of the configuration's
  std::string command_line;                ///< shown in the report
};

class StoredContents;

/// A session and where it came from.
struct InputSession {
  SessionData data;
  std::filesystem::path run;  ///< its run folder; empty for logs and stores
  std::int64_t row = 0;       ///< its row in the store it was read from; 0: it was not
};

/// Reads all sessions, sorted by name, names unique and fit for files. Damage is reported on stderr
/// and what is whole is kept. Cells are read when they are needed, by `contents`. Runs are copied
/// into files in `scratch_parent` that have no name on return and are gone with the process. Throws
/// std::runtime_error if there is nothing.
std::vector<InputSession> gather_sessions(const MergeOptions& options, StoredContents& contents,
                                          const std::filesystem::path& scratch_parent);

/// Makes sessions ready for a merge: sorted by name, names unique and fit for files, summaries
/// among the keyframes, and what knew no up levelled.
void prepare_sessions(std::vector<InputSession>& inputs);

/// Makes one session ready for a merge, but for what tells its name from others. Returns how many
/// keyframes were levelled.
std::size_t prepare_session(SessionData& session);
/// Adds "-2", "-3", ... where a name occurs again.
void tell_names_apart(const std::vector<SessionData*>& sessions);

/// Says on stderr what a source lacks.
void report_missing(const std::string& source, const SessionData& session);

/// The parameters that would be used, as JSON. Throws std::runtime_error for a wrong file.
std::string effective_config(const MergeOptions& options);

/// Merges and writes the map folder. Throws std::runtime_error with a sentence for the user.
void run_merge(const MergeOptions& options);

}  // namespace unimapper::apps
