// Merge of the sessions in a stored project.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "ports/store/project_writer.hpp"
#include "src/apps/map/stored_result.hpp"
#include "unimapper/merge/merge_config.hpp"
#include "unimapper/merge/merger.hpp"

namespace unimapper::apps {

/// A merge that ended with poses and loops, not yet an epoch.
struct ProjectResult {
  merge::MergeResult result;  ///< without labels, map and changes
  store::MapResult stored;    ///< the result as the store keeps it
  std::string outcome;        ///< in words
  std::string verified;       ///< how many loops were, in words
};

/// A merge that ended with poses and loops, with the sessions that were merged.
struct ProjectMerge : ProjectResult {
  std::vector<SessionData> sessions;  ///< as they were read
  std::vector<std::int64_t> rows;     ///< rows of the sessions in the store
};

/// Merges sessions that are known to the caller, under these statements.
using MergePoses = std::function<merge::MergeResult(const merge::UserStatements& statements,
                                                    merge::LoopOutcomes& outcomes)>;

/// Verifies loops of the sessions in `rows` elsewhere, as `merge::LoopOutcomes::verify`.
using VerifyElsewhere = std::function<std::vector<merge::LoopConstraint>(
    const KeyframeRows& rows, std::span<const merge::LoopQuestion> questions,
    const merge::CorrectionLimit& limit, const merge::VerifyHere& verify_here)>;

/// What `merge_poses` makes of sessions of a project that are in memory, as `merge_stored` below.
ProjectResult merge_held(store::ProjectWriter& writer, const store::ProjectState& state,
                         const KeyframeRows& rows, const merge::MergeConfig& config,
                         std::optional<std::int64_t> reference, const MergePoses& merge_poses,
                         const VerifyElsewhere& elsewhere = {});

/// Why the sensor data do not bear out a link, as a sentence; empty: they do, or say nothing
/// against it. Reads the two sessions. Throws std::runtime_error where they cannot be read.
std::string objection_to(const std::filesystem::path& store, const store::StoredStatement& link);

/// Merges the sessions of a project as it is stored. Outcomes of verification are stored on the
/// way, the result is not. `reference`: row of the session whose frame is the map's unless people
/// say otherwise. Throws std::runtime_error with a sentence for the user.
ProjectMerge merge_stored(store::ProjectWriter& writer, const std::filesystem::path& store,
                          const store::ProjectState& state, const merge::MergeConfig& config,
                          const std::function<void(const std::string&)>& progress,
                          std::optional<std::int64_t> reference = {},
                          const VerifyElsewhere& elsewhere = {});

}  // namespace unimapper::apps
