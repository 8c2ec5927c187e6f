// Maps of a stored project with their keyframes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "src/apps/map/stored_sessions.hpp"
#include "src/apps/merge/merge_options.hpp"
#include "unimapper/merge/merge_config.hpp"
#include "unimapper/merge/merger.hpp"

namespace unimapper::apps {

/// The result of a merge, as an epoch has it.
struct StoredMap {
  std::int64_t epoch = 0;             ///< its number
  std::vector<std::int64_t> rows;     ///< of the sessions in the store
  std::vector<SessionData> sessions;  ///< with the keyframes that were merged
  merge::MergeResult posed;           ///< poses and loops, for `merge::complete_merge`
  merge::MergeConfig config;          ///< the parameters of the merge
  std::string crs;                    ///< coordinate system of the site; empty: not said
};

/// Reads the map of an epoch, of the latest one for 0. Throws std::runtime_error with a sentence
/// for the user: no store, no such epoch, no map in it, or damage. `contents` and `order`: as of
/// `read_sessions`.
StoredMap read_stored_map(const std::filesystem::path& store, std::int64_t epoch,
                          StoredContents* contents = nullptr,
                          SessionOrder order = SessionOrder::kName);

}  // namespace unimapper::apps
