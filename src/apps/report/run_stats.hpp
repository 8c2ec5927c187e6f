// Stage times of a run.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "src/apps/report/measured_load.hpp"

namespace unimapper::apps {

/// Percentiles of one stage over the keyframes of a run, milliseconds.
struct StageLatency {
  std::string name;
  double p50_ms = 0.0;
  double p99_ms = 0.0;
  double max_ms = 0.0;
};

/// The stage of stats.json that is the sum of all.
inline constexpr const char* kTotalStage = "total";

/// What a report shows of a run's stats.json. Members stay empty where the file lacks them.
struct RunStats {
  std::vector<StageLatency> stages;
  /// Histogram of the total time per keyframe: one count per upper edge, the last one above all.
  std::vector<double> histogram_edges_ms;
  std::vector<std::uint64_t> histogram_counts;
  /// What was unusual about the recording, "CHECK: sentence" each.
  std::vector<std::string> input_warnings;
  std::optional<MeasuredLoad> load;  ///< of the machine during the run
  std::optional<std::uint64_t> arena_bytes;
  std::optional<std::uint64_t> allocations_after_start;
};

/// Reads RUN/stats.json; nothing if there is no such file or it cannot be parsed: the report is
/// complete without.
[[nodiscard]] std::optional<RunStats> read_run_stats(const std::filesystem::path& run);

}  // namespace unimapper::apps
