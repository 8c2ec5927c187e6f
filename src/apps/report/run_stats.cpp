// Stage times of a run.
#include "src/apps/report/run_stats.hpp"

#include <fstream>
#include <nlohmann/json.hpp>

namespace unimapper::apps {
namespace {

using Json = nlohmann::ordered_json;

void read_optional(const Json& json, const char* key, std::optional<std::uint64_t>& value) {
  if (json.contains(key) && json[key].is_number_unsigned()) value = json[key];
}

RunStats parse(const Json& json) {
  RunStats stats;
  for (const auto& [name, times] : json.at("stage_ms").items()) {
    stats.stages.push_back({name, times.at("p50"), times.at("p99"), times.at("max")});
  }
  for (const Json& finding : json.value("input", Json::object()).value("findings", Json::array())) {
    if (finding.value("severity", "fine") == "fine") continue;
    stats.input_warnings.push_back(finding.value("check", "") + ": " +
                                   finding.value("message", ""));
  }
  if (json.contains("load")) stats.load = load_of_json(json["load"]);
  read_optional(json, "arena_bytes", stats.arena_bytes);
  read_optional(json, "allocations_after_start", stats.allocations_after_start);
  if (json.contains("total_histogram")) {
    const Json& histogram = json["total_histogram"];
    histogram.at("upper_edge_ms").get_to(stats.histogram_edges_ms);
    histogram.at("keyframes").get_to(stats.histogram_counts);
  }
  if (stats.histogram_counts.size() != stats.histogram_edges_ms.size() + 1) {
    stats.histogram_edges_ms.clear();
    stats.histogram_counts.clear();
  }
  return stats;
}

}  // namespace

std::optional<RunStats> read_run_stats(const std::filesystem::path& run) {
  if (run.empty()) return std::nullopt;
  std::ifstream in(run / "stats.json");
  if (!in) return std::nullopt;
  try {
    return parse(Json::parse(in));
  } catch (const Json::exception&) {
    return std::nullopt;
  }
}

}  // namespace unimapper::apps
