// Table of loops as comma-separated values.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "src/core/loop_record.hpp"

namespace unimapper::merge {

/// Reads a loops.csv. Columns are found by their names in the header line; further ones are
/// ignored. Throws std::runtime_error "FILE:LINE: REASON".
[[nodiscard]] std::vector<LoopRecord> read_loops_csv(const std::filesystem::path& file);

/// The table as text, header line first. Numbers read back to the same bits, quaternions have
/// w >= 0, fields with commas or quotes are quoted.
[[nodiscard]] std::string format_loops_csv(std::span<const LoopRecord> loops);

}  // namespace unimapper::merge
