// Latency report as JSON and as Markdown.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "measurement.hpp"

namespace unimapper::bench {

/// Keyframes after the warm-up that a steady state is reported from, at least.
inline constexpr std::size_t kLeastKeyframes = 40;

/// Bytes of a pipeline's memory by purpose.
struct MemorySplit {
  std::size_t mapping = 0;      ///< cells, voxels, evidence, labels
  std::size_t description = 0;  ///< the place describer
  std::size_t search = 0;       ///< stored places
  [[nodiscard]] std::size_t total() const { return mapping + description + search; }
};
[[nodiscard]] MemorySplit memory_split(const PipelineConfig& config);

/// What was measured, and how.
struct Report {
  SplitMeasurement times;
  PipelineConfig config;
  std::string title;
  bool there_and_back = false;
  std::size_t recorded = 0;                  ///< scans of the recording
  std::size_t steps = 0;                     ///< scans of one drive
  std::optional<std::size_t> touched_bytes;  ///< of the pipeline's memory after the warm-up

  /// Whether there are enough keyframes after the warm-up.
  [[nodiscard]] bool is_steady() const { return times.steady.keyframes() >= kLeastKeyframes; }
};

/// Percentiles of stages and calls in the steady state and while warming up, points per second,
/// multiples of the baseline, drops, memory. `"ms"` is empty where it was too short for the former.
[[nodiscard]] nlohmann::ordered_json to_json(const Report& report);

/// The same as a Markdown table.
[[nodiscard]] std::string to_table(const Report& report);

}  // namespace unimapper::bench
