#include "report.hpp"

#include <cstdarg>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "unimapper/core/arena.hpp"
#include "unimapper/place/database.hpp"
#include "unimapper/place/describer.hpp"

namespace unimapper::bench {
namespace {

using Json = nlohmann::ordered_json;

template <typename Part, typename... Config>
std::size_t bytes_of(const Config&... config) {
  Arena arena = Arena::measuring();
  Part part;
  part.allocate(arena, config...);
  return arena.used();
}

[[gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...) {
  char line[256];
  va_list values;
  va_start(values, pattern);
  std::vsnprintf(line, sizeof line, pattern, values);
  va_end(values);
  return line;
}

/// One row per stage, then the closing call and the baseline.
template <typename Visitor>
void for_each_row(const Measurement& measurement, const Visitor& visit) {
  for (std::size_t i = 0; i < kStages; ++i) {
    visit(std::string(stage_name(static_cast<Stage>(i))), percentiles(measurement.stage_ms[i]));
  }
  visit("closing call", percentiles(measurement.closing_call_ms));
  visit("baseline", percentiles(measurement.baseline_ms));
}

double multiple(const Percentiles& times, const Measurement& measurement) {
  const double baseline = percentiles(measurement.baseline_ms).p50;
  return baseline > 0.0 ? times.p50 / baseline : 0.0;
}

}  // namespace

MemorySplit memory_split(const PipelineConfig& config) {
  MemorySplit split;
  split.description = bytes_of<PlaceDescriber>(config.descriptor, config.descriptor_input());
  split.search = bytes_of<PlaceDatabase>(config.loop_search, config.place_shape());
  split.mapping = Pipeline::required_bytes(config) - split.description - split.search;
  return split;
}

Json to_json(const Measurement& measurement, const PipelineConfig& config) {
  Json json;
  json["keyframes"] = measurement.closing_call_ms.size();
  json["points"] = measurement.points;
  for_each_row(measurement, [&](const std::string& name, const Percentiles& times) {
    json["ms"][name] = {{"p50", times.p50},
                        {"p99", times.p99},
                        {"p99.9", times.p999},
                        {"max", times.max},
                        {"of_baseline", multiple(times, measurement)}};
  });
  json["points_per_second"] = {{"ingest", measurement.points_per_second(Stage::kIngest)},
                               {"total", measurement.points_per_second(Stage::kTotal)}};
  for (std::size_t i = 0; i < kDropCauses; ++i) {
    json["dropped"][std::string(drop_cause_name(static_cast<DropCause>(i)))] =
        measurement.dropped[i];
  }
  const MemorySplit split = memory_split(config);
  json["bytes"] = {{"mapping", split.mapping},
                   {"description", split.description},
                   {"search", split.search},
                   {"total", split.total()}};
  return json;
}

std::string to_table(const std::string& title, const Measurement& measurement,
                     const PipelineConfig& config) {
  std::string table =
      format("\n| %s: ms per keyframe | p50 | p99 | p99.9 | max | x baseline |\n", title.c_str());
  table += "|---|---|---|---|---|---|\n";
  for_each_row(measurement, [&](const std::string& name, const Percentiles& times) {
    table += format("| %s | %.2f | %.2f | %.2f | %.2f | %.1f |\n", name.c_str(), times.p50,
                    times.p99, times.p999, times.max, multiple(times, measurement));
  });
  const MemorySplit split = memory_split(config);
  const auto megabytes = [](std::size_t bytes) { return static_cast<double>(bytes) * 1e-6; };
  table += format("\n%zu keyframes, %.1f M points/s ingested, %.1f M points/s in all; ",
                  measurement.closing_call_ms.size(),
                  measurement.points_per_second(Stage::kIngest) * 1e-6,
                  measurement.points_per_second(Stage::kTotal) * 1e-6);
  table +=
      format("%.1f MB (mapping %.1f, description %.1f, search %.1f)\n", megabytes(split.total()),
             megabytes(split.mapping), megabytes(split.description), megabytes(split.search));
  return table;
}

}  // namespace unimapper::bench
