// CSV format of loops, written by `onboard` and `merge`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "unimapper/core/pose.hpp"

namespace unimapper::apps {

/// One line of loops.csv.
struct LoopRow {
  std::string query_session;
  std::uint32_t query_keyframe = 0;
  std::uint32_t query_scan = 0;
  std::string match_session;
  std::uint32_t match_keyframe = 0;
  std::uint32_t match_scan = 0;
  double confidence = 0.0;
  bool accepted = false;
  std::string reason;
  Pose T_match_query;  ///< between the sensor frames of the two reference scans
};

/// Reads a loops.csv. Columns are found by their names in the header line; further ones are
/// left alone. Throws std::runtime_error "FILE:LINE: REASON".
[[nodiscard]] std::vector<LoopRow> read_loops_csv(const std::filesystem::path& file);

/// The table as text, header line first. Numbers read back to the same bits; fields with commas
/// or quotes are quoted.
[[nodiscard]] std::string format_loops_csv(std::span<const LoopRow> rows);

}  // namespace unimapper::apps
