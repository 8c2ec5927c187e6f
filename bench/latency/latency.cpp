// Command-line tool: latency of a keyframe by stage, tables on stderr and JSON on stdout.
//
// Scans are read into memory first, so that file access is not timed.
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "background_load.hpp"
#include "hashing_baseline.hpp"
#include "hostile.hpp"
#include "measurement.hpp"
#include "ports/datasets/dataset.hpp"
#include "report.hpp"
#include "scaling.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::bench;

constexpr const char* kUsage =
    R"(usage: latency DATASET [SENSOR] [--paper] [--leaf M] [--repeat N] [--scans N]
               [--load] [--wall] [--hostile N]
       latency --scaling FOLDER [KEYFRAMES]

  --load       stream through memory on another processor meanwhile
  --wall       wall-clock times instead of the processor's (for a machine that is idle)
  --hostile N  also time N keyframes of every kind of hostile scan against this recording's worst
  --scaling    cost against points and against KEYFRAMES (10000) driven, as CSV files
)";

struct Options {
  std::vector<std::string> positional;
  bool paper = false;
  bool load = false;
  bool wall = false;
  bool scaling = false;
  float leaf_m = 0.0F;
  int repeat = 1;
  int hostile = 0;
  std::size_t scans = static_cast<std::size_t>(-1);
};

bool parse(int argc, char** argv, Options& options) {
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const char* const value = i + 1 < argc ? argv[i + 1] : nullptr;
    const auto number = [&] { return std::max(1, std::atoi(argv[++i])); };
    if (word == "--paper") {
      options.paper = true;
    } else if (word == "--load") {
      options.load = true;
    } else if (word == "--wall") {
      options.wall = true;
    } else if (word == "--scaling") {
      options.scaling = true;
    } else if (word == "--leaf" && value != nullptr) {
      options.leaf_m = std::strtof(argv[++i], nullptr);
    } else if (word == "--repeat" && value != nullptr) {
      options.repeat = number();
    } else if (word == "--hostile" && value != nullptr) {
      options.hostile = number();
    } else if (word == "--scans" && value != nullptr) {
      options.scans = static_cast<std::size_t>(number());
    } else if (word.empty() || word[0] == '-') {
      return false;
    } else {
      options.positional.push_back(word);
    }
  }
  return !options.positional.empty() && options.positional.size() <= 2;
}

PipelineConfig make_config(const Options& options, const std::string& sensor_name) {
  const SensorModel* const sensor = find_sensor(sensor_name);
  if (sensor == nullptr) throw std::runtime_error("unknown sensor '" + sensor_name + "'");
  PipelineConfig config = options.paper ? paper_preset(sensor->kind) : preset(sensor->kind);
  config.keyframe.downsample_leaf_m = options.leaf_m;
  config.clock_ns = options.wall ? wall_time_ns : processor_time_ns;
  return config;
}

/// Runs the recording through a new pipeline, and the baseline over the same keyframes.
void measure(const PipelineConfig& config, const datasets::Dataset& dataset,
             const std::vector<datasets::Scan>& scans, Measurement& measurement) {
  OwnedPipeline pipeline(config);
  HashingBaseline baseline(config);
  std::size_t first = 0;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const TimedScan scan{scans[i].view(), dataset.pose(i), dataset.stamp_ns(i)};
    if (!feed(pipeline, scan, config.clock_ns, measurement)) continue;
    const std::int64_t start_ns = config.clock_ns();
    for (; first <= i; ++first) baseline.read_and_hash(scans[first].view());
    measurement.baseline_ms.push_back(static_cast<double>(config.clock_ns() - start_ns) * 1e-6);
  }
}

void time_recording(const Options& options) {
  const auto dataset = datasets::open_dataset(options.positional[0]);
  const std::string sensor = options.positional.size() > 1 ? options.positional[1]
                             : dataset->sensor().empty()   ? "hdl-64e"
                                                           : dataset->sensor();
  const PipelineConfig config = make_config(options, sensor);
  std::vector<datasets::Scan> scans(std::min(options.scans, dataset->scan_count()));
  for (std::size_t i = 0; i < scans.size(); ++i) dataset->read_scan(i, scans[i]);

  Measurement measurement;
  const BackgroundLoad background_load(options.load);
  for (int i = 0; i < options.repeat; ++i) measure(config, *dataset, scans, measurement);
  nlohmann::ordered_json json = to_json(measurement, config);
  json["recording"] = options.positional[0];
  json["sensor"] = sensor;
  json["other_core"] = options.load ? "loaded" : "not loaded";
  json["clock"] = options.wall ? "wall" : "processor";
  const std::filesystem::path folder = std::filesystem::path(options.positional[0]) / "";
  const std::string title = folder.parent_path().filename().string() + ", preset " + sensor +
                            (options.load ? ", other core loaded" : "");
  std::fputs(to_table(title, measurement, config).c_str(), stderr);
  if (options.hostile > 0) {
    const auto total = static_cast<std::size_t>(Stage::kTotal);
    json["hostile"] =
        time_hostile_scans(config, percentiles(measurement.stage_ms[total]).max, options.hostile);
  }
  std::printf("%s\n", json.dump(2).c_str());
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  if (!parse(argc, argv, options)) {
    std::fputs(kUsage, stderr);
    return 1;
  }
  try {
    if (!options.scaling) {
      time_recording(options);
      return 0;
    }
    const int keyframes =
        options.positional.size() > 1 ? std::atoi(options.positional[1].c_str()) : 10000;
    measure_points(options.positional[0]);
    measure_distance(options.positional[0], keyframes);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
  return 0;
}
