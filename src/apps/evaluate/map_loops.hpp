// Precision and recall of the loops of a map.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

#include "src/apps/evaluate/map_alignment.hpp"
#include "src/apps/evaluate/shown_map.hpp"
#include "src/evaluate/loops.hpp"

namespace unimapper::apps {

/// Scores MAP/loops.csv, loops within sessions and between them together: every keyframe of a
/// session with truth is searched for among those of sessions before it and those earlier in its
/// own. Loops of sessions without truth are left out. Throws std::runtime_error.
/// O(keyframes squared).
[[nodiscard]] evaluate::LoopScore score_map_loops(const std::filesystem::path& map,
                                                  std::span<const ShownSession> shown,
                                                  std::span<const PairedSession> paired);

}  // namespace unimapper::apps
