// Command-line tool: latency of calls and keyframes, tables on stderr and JSON on stdout.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "background_load.hpp"
#include "drive.hpp"
#include "hashing_baseline.hpp"
#include "hostile.hpp"
#include "measurement.hpp"
#include "page_use.hpp"
#include "ports/datasets/dataset.hpp"
#include "report.hpp"
#include "scaling.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::bench;

struct Options {
  std::filesystem::path dataset;
  std::string sensor;
  std::string preset = "default";
  bool there_and_back = false;
  bool load = false;
  bool wall = false;
  std::filesystem::path scaling;
  int keyframes = 10000;
  float leaf_m = 0.0F;
  bool deferred = false;
  int hostile = 0;
  std::size_t scans = static_cast<std::size_t>(-1);
};

void declare(CLI::App& app, Options& options) {
  auto* const dataset = app.add_option("DATASET", options.dataset, "Recording to run through");
  app.add_option("SENSOR", options.sensor, "LiDAR (default: the recording's, or hdl-64e)");
  app.add_option("--preset", options.preset, "Parameters, as of unimapper onboard")
      ->capture_default_str()
      ->check(CLI::IsMember({"default", "paper", "jetson", "raspberry-pi", "armv7-64mb"}));
  app.add_flag("--there-and-back", options.there_and_back,
               "Forwards, backwards, forwards and so on, until there are enough keyframes for the "
               "steady state: for short recordings");
  app.add_option("--leaf", options.leaf_m, "Down-sampling of scans, metres");
  app.add_option("--scans", options.scans, "Only the first scans")->check(CLI::PositiveNumber);
  app.add_flag("--deferred", options.deferred, "Spread the work over the calls (deferred)");
  app.add_flag("--load", options.load, "Stream through memory on another processor meanwhile");
  app.add_flag("--wall", options.wall,
               "Wall-clock times instead of the processor's (for a machine that is idle)");
  app.add_option("--hostile", options.hostile,
                 "Also time so many keyframes of every kind of hostile scan, after the warm-up, "
                 "against this recording's worst")
      ->check(CLI::PositiveNumber);
  app.add_option("--scaling", options.scaling,
                 "Instead: cost against points and against keyframes driven, as CSV files in "
                 "this folder")
      ->excludes(dataset);
  app.add_option("--keyframes", options.keyframes, "With --scaling: keyframes driven")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
}

PipelineConfig preset_of(const std::string& name, SensorKind sensor) {
  if (name == "paper") return paper_preset(sensor);
  if (name == "jetson") return preset(sensor, Computer::kJetson);
  if (name == "raspberry-pi") return preset(sensor, Computer::kRaspberryPi);
  if (name == "armv7-64mb") return preset(sensor, Computer::kArmv7With64Mb);
  return preset(sensor);
}

PipelineConfig make_config(const Options& options, const std::string& sensor_name) {
  const SensorModel* const sensor = find_sensor(sensor_name);
  if (sensor == nullptr) throw std::runtime_error("unknown sensor '" + sensor_name + "'");
  PipelineConfig config = preset_of(options.preset, sensor->kind);
  config.keyframe.downsample_leaf_m = options.leaf_m;
  config.deferred = options.deferred;
  config.clock_ns = options.wall ? wall_time_ns : processor_time_ns;
  return config;
}

/// Drives with a new pipeline, then reads and hashes the scans of the same keyframes.
void measure(const Drive& drive, Report& report) {
  const PipelineConfig& config = report.config;
  OwnMapping memory(Pipeline::required_bytes(config));
  const Expected<Pipeline*> pipeline = Pipeline::create(config, memory.span());
  if (!pipeline.ok()) throw std::runtime_error(pipeline.error().message);
  Feeder feeder(**pipeline, config, report.times);
  const std::size_t enough = feeder.warm_up() + kLeastKeyframes;
  const std::size_t longest = drive.longest(report.there_and_back, enough);
  std::vector<std::size_t> ends;
  std::size_t step = 0;
  for (; step < longest; ++step) {
    if (!feeder.feed(drive[step])) continue;
    ends.push_back(step + 1);
    if (feeder.keyframes() == feeder.warm_up()) memory.start_counting();
    if (report.there_and_back && step + 1 >= drive.recorded() && ends.size() >= enough) break;
  }
  report.steps = step < longest ? step + 1 : longest;
  report.touched_bytes = memory.touched_bytes();

  HashingBaseline baseline(config);
  std::size_t first = 0;
  for (std::size_t keyframe = 0; keyframe < ends.size(); ++keyframe) {
    const std::int64_t start_ns = config.clock_ns();
    for (; first < ends[keyframe]; ++first) baseline.read_and_hash(drive[first].points);
    const double ms = static_cast<double>(config.clock_ns() - start_ns) * 1e-6;
    Measurement& part = keyframe < feeder.warm_up() ? report.times.warm_up : report.times.steady;
    part.baseline_ms.push_back(ms);
  }
}

std::string title_of(const Options& options, const std::string& sensor) {
  std::string title = (options.dataset / "").parent_path().filename().string() + ", " + sensor;
  if (options.preset != "default") title += ", preset " + options.preset;
  if (options.there_and_back) title += ", there and back";
  if (options.deferred) title += ", deferred";
  return title + (options.load ? ", other core loaded" : "");
}

void time_recording(const Options& options) {
  const auto dataset = datasets::open_dataset(options.dataset);
  const std::string sensor = !options.sensor.empty()     ? options.sensor
                             : dataset->sensor().empty() ? "hdl-64e"
                                                         : dataset->sensor();
  const Drive drive(*dataset, options.scans);
  Report report;
  report.config = make_config(options, sensor);
  report.title = title_of(options, sensor);
  report.there_and_back = options.there_and_back;
  report.recorded = drive.recorded();

  const BackgroundLoad background_load(options.load);
  measure(drive, report);
  nlohmann::ordered_json json = to_json(report);
  json["recording"] = options.dataset.string();
  json["sensor"] = sensor;
  json["preset"] = options.preset;
  json["deferred"] = options.deferred;
  json["other_core"] = options.load ? "loaded" : "not loaded";
  json["clock"] = options.wall ? "wall" : "processor";
  std::fputs(to_table(report).c_str(), stderr);
  if (options.hostile > 0) {
    if (!report.is_steady()) throw std::runtime_error("--hostile compares with the steady state");
    const auto total = static_cast<std::size_t>(Stage::kTotal);
    json["hostile"] = time_hostile_scans(
        report.config, percentiles(report.times.steady.stage_ms[total]).max, options.hostile);
  }
  std::printf("%s\n", json.dump(2).c_str());
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app{
      "How long every call of add_scan and every keyframe takes, once the window of keyframes is "
      "full; what came before is shown as warm-up. Tables go to stderr, JSON to stdout."};
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
