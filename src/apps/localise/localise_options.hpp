// Options and steps of `unimapper localise`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace unimapper::apps {

struct LocaliseOptions {
  std::filesystem::path run;             ///< a run folder or an event log
  std::string session;                   ///< of several in it; empty: all
  std::filesystem::path store;           ///< folder of the store with the map
  std::int64_t epoch = 0;                ///< 0: the latest
  std::filesystem::path out;             ///< TUM file; empty: none
  bool replaces = false;                 ///< overwrite the file
  bool json = false;                     ///< what is printed is JSON
  std::optional<std::uint32_t> threads;  ///< instead of the configuration's
};

/// Localises every keyframe of a run in a stored map, each session by itself, and prints the
/// answers. Throws std::runtime_error with a sentence for the user.
void run_localise(const LocaliseOptions& options);

}  // namespace unimapper::apps
