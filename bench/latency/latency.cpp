// Command-line tool: latency of a keyframe by stage, tables on stderr and JSON on stdout.
//
// Scans are read into memory first, so that file access is not timed.
#include <CLI/CLI.hpp>
#include <cstdio>
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

struct Options {
  std::filesystem::path dataset;
  std::string sensor;
  bool paper = false;
  bool load = false;
  bool wall = false;
  std::filesystem::path scaling;
  int keyframes = 10000;
  float leaf_m = 0.0F;
  int repeat = 1;
  int hostile = 0;
  std::size_t scans = static_cast<std::size_t>(-1);
};

void declare(CLI::App& app, Options& options) {
  auto* const dataset = app.add_option("DATASET", options.dataset, "Recording to run through");
  app.add_option("SENSOR", options.sensor, "LiDAR (default: the recording's, or hdl-64e)");
  app.add_flag("--paper", options.paper, "The paper's preset");
  app.add_option("--leaf", options.leaf_m, "Down-sampling of scans, metres");
  app.add_option("--repeat", options.repeat, "Runs through the recording")
      ->check(CLI::PositiveNumber);
  app.add_option("--scans", options.scans, "Only the first scans")->check(CLI::PositiveNumber);
  app.add_flag("--load", options.load, "Stream through memory on another processor meanwhile");
  app.add_flag("--wall", options.wall,
               "Wall-clock times instead of the processor's (for a machine that is idle)");
  app.add_option("--hostile", options.hostile,
                 "Also time so many keyframes of every kind of hostile scan against this "
                 "recording's worst")
      ->check(CLI::PositiveNumber);
  app.add_option("--scaling", options.scaling,
                 "Instead: cost against points and against keyframes driven, as CSV files in "
                 "this folder")
      ->excludes(dataset);
  app.add_option("--keyframes", options.keyframes, "With --scaling: keyframes driven")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
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
  const auto dataset = datasets::open_dataset(options.dataset);
  const std::string sensor = !options.sensor.empty()     ? options.sensor
                             : dataset->sensor().empty() ? "hdl-64e"
                                                         : dataset->sensor();
  const PipelineConfig config = make_config(options, sensor);
  std::vector<datasets::Scan> scans(std::min(options.scans, dataset->scan_count()));
  for (std::size_t i = 0; i < scans.size(); ++i) dataset->read_scan(i, scans[i]);

  Measurement measurement;
  const BackgroundLoad background_load(options.load);
  for (int i = 0; i < options.repeat; ++i) measure(config, *dataset, scans, measurement);
  nlohmann::ordered_json json = to_json(measurement, config);
  json["recording"] = options.dataset.string();
  json["sensor"] = sensor;
  json["other_core"] = options.load ? "loaded" : "not loaded";
  json["clock"] = options.wall ? "wall" : "processor";
  const std::filesystem::path folder = options.dataset / "";
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
  CLI::App app{"How long a keyframe takes, stage by stage. Tables go to stderr, JSON to stdout."};
  declare(app, options);
  CLI11_PARSE(app, argc, argv);
  try {
    if (!options.scaling.empty()) {
      measure_points(options.scaling.string());
      measure_distance(options.scaling.string(), options.keyframes);
    } else if (!options.dataset.empty()) {
      time_recording(options);
    } else {
      return app.exit(CLI::RequiredError("DATASET or --scaling"));
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "latency: %s\n", error.what());
    return 2;
  }
  return 0;
}
