// A person's statement on a loop as an epoch of a stored project.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "ports/store/project_writer.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/merge/merge_config.hpp"

namespace unimapper::apps {

/// What a person says of a loop: it is right, it is wrong, or neither for now.
enum class LoopStatement : std::uint8_t { kRight, kWrong, kNotYet };

/// A loop that a person looked at.
struct StatedLoop {
  store::KeyframeRow query;
  store::KeyframeRow match;
  std::optional<Pose> T_match_query;  ///< between sensors at the reference scans; none: not known
};

/// Links the keyframes of a loop, at its pose if it has one, forbids it or withdraws either, merges
/// with that, and makes one epoch of both. Costs a merge. Throws std::runtime_error with a sentence
/// for the user.
store::Epoch decide_on_loop(store::ProjectWriter& writer, const std::filesystem::path& store,
                            const StatedLoop& loop, LoopStatement said,
                            const merge::MergeConfig& config);

/// Goes back to an epoch, 0: to the one that the latest one changed; the copy stands where that
/// stood, so that another undo goes further back. Sessions that have arrived since stay. Throws
/// std::runtime_error where there is none.
std::optional<store::Epoch> go_back(store::ProjectWriter& writer, std::int64_t number = 0);

}  // namespace unimapper::apps
