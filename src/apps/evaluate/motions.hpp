// Reader of the times at which simulated objects move.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "src/evaluate/dynamic.hpp"

namespace unimapper::apps {

/// Intervals of motion of the recording in `directory`, from motion.txt; empty if it has none.
/// Throws std::runtime_error naming the line that cannot be read.
std::optional<std::vector<evaluate::MotionInterval>> read_motions(
    const std::filesystem::path& directory);

}  // namespace unimapper::apps
