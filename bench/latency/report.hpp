// Latency report as JSON and as Markdown.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "measurement.hpp"

namespace unimapper::bench {

/// Bytes of a pipeline's memory by purpose.
struct MemorySplit {
  std::size_t mapping = 0;      ///< cells, voxels, evidence, labels
  std::size_t description = 0;  ///< the place describer
  std::size_t search = 0;       ///< stored places
  [[nodiscard]] std::size_t total() const { return mapping + description + search; }
};
[[nodiscard]] MemorySplit memory_split(const PipelineConfig& config);

/// Percentiles per stage, points per second, multiples of the baseline, drops, memory.
[[nodiscard]] nlohmann::ordered_json to_json(const Measurement& measurement,
                                             const PipelineConfig& config);

/// The same as a Markdown table.
[[nodiscard]] std::string to_table(const std::string& title, const Measurement& measurement,
                                   const PipelineConfig& config);

}  // namespace unimapper::bench
