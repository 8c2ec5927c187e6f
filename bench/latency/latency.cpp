// Command-line tool: latency of calls and keyframes, as Markdown.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>

#include "drive.hpp"
#include "measurement.hpp"
#include "ports/datasets/dataset.hpp"
#include "ports/linux/executor.hpp"
#include "unimapper/onboard/owned_pipeline.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::bench;

struct Options {
  std::filesystem::path dataset;
  std::string sensor;
  std::string preset = "default";
  bool there_and_back = false;
  bool deferred = false;
  std::uint32_t workers = 1;
};

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
  config.deferred = options.deferred;
  config.clock_ns = options.workers > 1 ? wall_time_ns : processor_time_ns;
  return config;
}

std::string title_of(const Options& options, const std::string& sensor) {
  std::string title = (options.dataset / "").parent_path().filename().string() + ", " + sensor;
  if (options.preset != "default") title += ", preset " + options.preset;
  if (options.there_and_back) title += ", there and back";
  if (options.workers > 1) title += ", " + std::to_string(options.workers) + " workers";
  return title + (options.deferred ? ", deferred" : "");
}

void time_recording(const Options& options) {
  const auto dataset = datasets::open_dataset(options.dataset);
  const std::string sensor = !options.sensor.empty()     ? options.sensor
                             : dataset->sensor().empty() ? "hdl-64e"
                                                         : dataset->sensor();
  PipelineConfig config = make_config(options, sensor);
  linux_port::WorkerThreads threads(options.workers);
  if (!threads.outcome().ok) throw std::runtime_error(threads.outcome().message);
  config.executor = threads.executor();
  const Drive drive(*dataset);
  OwnedPipeline pipeline(config);
  if (!pipeline) throw std::runtime_error(pipeline.error().message);
  SplitMeasurement times;
  Feeder feeder(*pipeline, config, times);
  const std::size_t enough = feeder.warm_up() + kLeastKeyframes;
  const std::size_t longest = drive.longest(options.there_and_back, enough);
  std::size_t steps = 0;
  while (steps < longest) {
    const bool is_enough = feeder.feed(drive[steps++]) && feeder.keyframes() >= enough;
    if (options.there_and_back && steps >= drive.recorded() && is_enough) break;
  }
  std::fputs(to_table(times, title_of(options, sensor)).c_str(), stdout);
  std::printf("%zu keyframes after %u of warm-up; %zu scans of a recording of %zu.\n",
              times.steady.keyframes(), feeder.warm_up(), steps, drive.recorded());
  std::printf("%.0f MB.\n", static_cast<double>(Pipeline::required_bytes(config)) * 1e-6);
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app{
      "How long every call of add_scan and every keyframe takes, processor time, once the window "
      "of keyframes is full; what came before is shown as warm-up. Prints Markdown."};
  app.add_option("DATASET", options.dataset, "Recording to run through")->required();
  app.add_option("SENSOR", options.sensor, "LiDAR (default: the recording's, or hdl-64e)");
  app.add_option("--preset", options.preset, "Parameters, as of unimapper onboard")
      ->capture_default_str()
      ->check(CLI::IsMember({"default", "paper", "jetson", "raspberry-pi", "armv7-64mb"}));
  app.add_flag("--there-and-back", options.there_and_back,
               "Forwards, backwards, forwards and so on, until there are enough keyframes for the "
               "steady state: for short recordings");
  app.add_flag("--deferred", options.deferred, "Spread the work over the calls (deferred)");
  app.add_option("--workers", options.workers,
                 "Processors that close a keyframe; with several, times are those of the clock")
      ->capture_default_str()
      ->check(CLI::Range(1U, Executor::kMaxWorkers));
  CLI11_PARSE(app, argc, argv);
  try {
    time_recording(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "latency: %s\n", error.what());
    return 2;
  }
  return 0;
}
