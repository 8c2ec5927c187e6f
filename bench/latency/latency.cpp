// How long a keyframe takes, stage by stage.
//
//   latency DATASET [SENSOR] [--paper] [--leaf M] [--repeat N]
//
// Reads every scan into memory first, so that no disk is timed. A table goes to stderr, JSON to
// stdout. Times are of the processor, not of the wall: other work on the machine counts less.
#include <time.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "ports/datasets/dataset.hpp"
#include "unimapper/onboard/pipeline.hpp"

namespace {

using namespace unimapper;

std::int64_t processor_time_ns() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return now.tv_sec * std::int64_t{1000000000} + now.tv_nsec;
}

struct Options {
  std::string dataset;
  std::string sensor = "hdl-64e";
  bool paper = false;
  float leaf_m = 0.0F;
  int repeat = 1;
};

bool parse(int argc, char** argv, Options& options) {
  int positional = 0;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--paper") {
      options.paper = true;
    } else if (word == "--leaf" && i + 1 < argc) {
      options.leaf_m = std::strtof(argv[++i], nullptr);
    } else if (word == "--repeat" && i + 1 < argc) {
      options.repeat = std::max(1, std::atoi(argv[++i]));
    } else if (word.empty() || word[0] == '-' || positional > 1) {
      return false;
    } else {
      (positional++ == 0 ? options.dataset : options.sensor) = word;
    }
  }
  return positional > 0;
}

/// Everything measured, over all keyframes.
struct Measurements {
  std::vector<float> stage_ms[kStages];
  std::uint64_t points = 0;
  std::size_t arena_bytes = 0;

  void add(const KeyframeStatistics& statistics) {
    points += statistics.points_in;
    for (std::size_t i = 0; i < kStages; ++i) {
      stage_ms[i].push_back(statistics.stage_us[i] * 1e-3F);
    }
  }
};

float percentile(std::vector<float> values, double share) {
  if (values.empty()) return 0.0F;
  const auto at = static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(at), values.end());
  return values[at];
}

void run(const PipelineConfig& config, const datasets::Dataset& dataset,
         const std::vector<datasets::Scan>& scans, Measurements& measurements) {
  measurements.arena_bytes = Pipeline::required_bytes(config);
  const std::unique_ptr<std::byte, decltype(&std::free)> block(
      static_cast<std::byte*>(std::aligned_alloc(64, measurements.arena_bytes)), &std::free);
  auto pipeline = Pipeline::create(config, {block.get(), measurements.arena_bytes});
  if (!pipeline.ok()) throw std::runtime_error(pipeline.error().message);
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const ScanResult result =
        (*pipeline)->add_scan(scans[i].view(), dataset.pose(i), dataset.stamp_ns(i));
    if (result.error.code != ErrorCode::kOk) {
      std::fprintf(stderr, "scan %zu: %s\n", i, result.error.message);
    }
    if (result.keyframe_ready) measurements.add(*(*pipeline)->keyframe().statistics);
  }
}

void report(const Measurements& measurements) {
  nlohmann::json json;
  std::fprintf(stderr, "%-12s %9s %9s %9s   ms per keyframe\n", "stage", "p50", "p99", "max");
  for (std::size_t i = 0; i < kStages; ++i) {
    const std::vector<float>& values = measurements.stage_ms[i];
    const float p50 = percentile(values, 0.5);
    const float p99 = percentile(values, 0.99);
    const float max = percentile(values, 1.0);
    const std::string name(stage_name(static_cast<Stage>(i)));
    std::fprintf(stderr, "%-12s %9.2f %9.2f %9.2f\n", name.c_str(), p50, p99, max);
    json["stage_ms"][name] = {{"p50", p50}, {"p99", p99}, {"max", max}};
  }
  double ingest_s = 0.0;
  for (const float ms : measurements.stage_ms[static_cast<std::size_t>(Stage::kIngest)]) {
    ingest_s += static_cast<double>(ms) * 1e-3;
  }
  const double rate = ingest_s > 0.0 ? static_cast<double>(measurements.points) / ingest_s : 0.0;
  json["keyframes"] = measurements.stage_ms[0].size();
  json["points"] = measurements.points;
  json["ingested_points_per_second"] = rate;
  json["arena_bytes"] = measurements.arena_bytes;
  std::fprintf(stderr, "%zu keyframes, %.1f M points/s ingested, %.1f MB\n",
               measurements.stage_ms[0].size(), rate * 1e-6,
               static_cast<double>(measurements.arena_bytes) * 1e-6);
  std::printf("%s\n", json.dump(2).c_str());
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  if (!parse(argc, argv, options)) {
    std::fprintf(stderr, "usage: latency DATASET [SENSOR] [--paper] [--leaf M] [--repeat N]\n");
    return 1;
  }
  const SensorModel* sensor = find_sensor(options.sensor);
  if (sensor == nullptr) {
    std::fprintf(stderr, "unknown sensor '%s'\n", options.sensor.c_str());
    return 1;
  }
  try {
    const auto dataset = datasets::open_dataset(options.dataset);
    std::vector<datasets::Scan> scans(dataset->scan_count());
    for (std::size_t i = 0; i < scans.size(); ++i) dataset->read_scan(i, scans[i]);
    PipelineConfig config = options.paper ? paper_preset(sensor->kind) : preset(sensor->kind);
    config.keyframe.downsample_leaf_m = options.leaf_m;
    config.clock_ns = processor_time_ns;
    Measurements measurements;
    for (int i = 0; i < options.repeat; ++i) run(config, *dataset, scans, measurements);
    report(measurements);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
  return 0;
}
