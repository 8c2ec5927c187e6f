// Refined labels of a recording's scans.
#pragma once

#include <cstddef>
#include <filesystem>

#include "unimapper/merge/merger.hpp"

namespace unimapper::apps {

/// Writes FOLDER/labels/NAME.label for every scan of `dataset` that went into a keyframe, as
/// `unimapper onboard` does: 251 for dynamic points, 9 for all others; scans in no whole keyframe
/// are all static, and how many these are is returned. `unimapper evaluate dynamic --run FOLDER`
/// scores it. Throws DatasetError, and std::runtime_error if the dataset is not the one the session
/// was made of. O(points).
std::size_t write_refined_labels(const std::filesystem::path& folder,
                                 const std::filesystem::path& dataset, const SessionData& session,
                                 const merge::MergedSession& merged);

}  // namespace unimapper::apps
