#include "report.hpp"

#include <cstdarg>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <vector>

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

/// One row per stage, then those of the calls and the baseline.
template <typename Visitor>
void for_each_row(const Measurement& measurement, const Visitor& visit) {
  for (std::size_t i = 0; i < kStages; ++i) {
    visit(std::string(stage_name(static_cast<Stage>(i))), percentiles(measurement.stage_ms[i]));
  }
  visit("every call", percentiles(measurement.calls_ms()));
  visit("closing call", percentiles(measurement.calls_ms(true)));
  visit("other calls", percentiles(measurement.calls_ms(false)));
  visit("baseline", percentiles(measurement.baseline_ms));
}

double multiple(const Percentiles& times, const Measurement& measurement) {
  const double baseline = percentiles(measurement.baseline_ms).p50;
  return baseline > 0.0 ? times.p50 / baseline : 0.0;
}

Json times_to_json(const Measurement& measurement) {
  Json json = Json::object();
  for_each_row(measurement, [&](const std::string& name, const Percentiles& times) {
    json[name] = {{"p50", times.p50},
                  {"p90", times.p90},
                  {"p99", times.p99},
                  {"max", times.max},
                  {"of_baseline", multiple(times, measurement)}};
  });
  return json;
}

double megabytes(std::size_t bytes) { return static_cast<double>(bytes) * 1e-6; }

std::string how_driven(const Report& report) {
  return report.there_and_back ? "there and back" : "once";
}

/// Rows of the steady state with what they were while warming up beside them.
std::string steady_table(const Report& report) {
  const Measurement& steady = report.times.steady;
  std::string table =
      format("| %s: ms | p50 | p90 | p99 | max | x baseline | warm-up: p50 | max |\n",
             report.title.c_str());
  table += "|---|---|---|---|---|---|---|---|\n";
  std::vector<Percentiles> warm_up;
  for_each_row(report.times.warm_up,
               [&](const std::string&, const Percentiles& times) { warm_up.push_back(times); });
  std::size_t row = 0;
  for_each_row(steady, [&](const std::string& name, const Percentiles& times) {
    const Percentiles& before = warm_up[row++];
    table +=
        format("| %s | %.2f | %.2f | %.2f | %.2f | %.2f | %.2f | %.2f |\n", name.c_str(), times.p50,
               times.p90, times.p99, times.max, multiple(times, steady), before.p50, before.max);
  });
  const Call& longest = steady.longest_call();
  table +=
      format("\nThe longest call took %.2f ms: scan %zu of the drive, %s keyframe %u.\n",
             longest.ms, longest.step, longest.closes ? "which closes" : "in", longest.keyframe);
  table += format("%.1f M points/s ingested, %.1f M points/s in all.\n",
                  steady.points_per_second(Stage::kIngest) * 1e-6,
                  steady.points_per_second(Stage::kTotal) * 1e-6);
  return table;
}

std::string warm_up_table(const Report& report) {
  std::string table =
      format("| %s: ms while warming up | p50 | max |\n|---|---|---|\n", report.title.c_str());
  for_each_row(report.times.warm_up, [&](const std::string& name, const Percentiles& times) {
    table += format("| %s | %.2f | %.2f |\n", name.c_str(), times.p50, times.max);
  });
  table += format(
      "\nToo short for a steady state: %zu keyframes after the %u of the warm-up, and "
      "it takes %zu%s.\n",
      report.times.steady.keyframes(), warm_up_keyframes(report.config), kLeastKeyframes,
      report.there_and_back ? "" : " (--there-and-back)");
  return table;
}

}  // namespace

MemorySplit memory_split(const PipelineConfig& config) {
  MemorySplit split;
  split.description = bytes_of<PlaceDescriber>(config.descriptor, config.descriptor_input());
  split.search = bytes_of<PlaceDatabase>(config.loop_search, config.place_shape());
  split.mapping = Pipeline::required_bytes(config) - split.description - split.search;
  return split;
}

Json to_json(const Report& report) {
  const Measurement& steady = report.times.steady;
  Json json;
  json["drive"] = how_driven(report);
  json["recorded_scans"] = report.recorded;
  json["scans"] = report.steps;
  json["keyframes"] = steady.keyframes();
  json["warm_up_keyframes"] = warm_up_keyframes(report.config);
  json["steady"] = report.is_steady();
  json["ms"] = report.is_steady() ? times_to_json(steady) : Json::object();
  if (report.is_steady()) {
    const Call& longest = steady.longest_call();
    json["longest_call"] = {{"ms", longest.ms},
                            {"scan", longest.step},
                            {"keyframe", longest.keyframe},
                            {"closes", longest.closes}};
    json["points_per_second"] = {{"ingest", steady.points_per_second(Stage::kIngest)},
                                 {"total", steady.points_per_second(Stage::kTotal)}};
  }
  json["warm_up_ms"] = times_to_json(report.times.warm_up);
  for (std::size_t i = 0; i < kDropCauses; ++i) {
    json["dropped"][std::string(drop_cause_name(static_cast<DropCause>(i)))] =
        report.times.warm_up.dropped[i] + steady.dropped[i];
  }
  const MemorySplit split = memory_split(report.config);
  json["bytes"] = {{"mapping", split.mapping},
                   {"description", split.description},
                   {"search", split.search},
                   {"total", split.total()}};
  if (report.touched_bytes) json["bytes"]["touched"] = *report.touched_bytes;
  return json;
}

std::string to_table(const Report& report) {
  std::string table = "\n" + (report.is_steady() ? steady_table(report) : warm_up_table(report));
  table +=
      format("%zu keyframes after %u of warm-up; %zu scans, the %zu of the recording driven %s.\n",
             report.times.steady.keyframes(), warm_up_keyframes(report.config), report.steps,
             report.recorded, how_driven(report).c_str());
  const MemorySplit split = memory_split(report.config);
  table += format("%.1f MB (mapping %.1f, description %.1f, search %.1f)", megabytes(split.total()),
                  megabytes(split.mapping), megabytes(split.description), megabytes(split.search));
  if (report.touched_bytes) {
    table +=
        format(", of which %.1f were touched after the warm-up", megabytes(*report.touched_bytes));
  }
  return table + ".\n";
}

}  // namespace unimapper::bench
