// Command-line tool: instructions per keyframe and stage, counted by qemu.
//
// Runs in qemu's user mode with the plugin of count_instructions.c; run.sh does that for every
// processor.
//
//   stage_instructions DATASET [SENSOR] [--there-and-back]
//
// Prints the name of each stage and the median over the keyframes after the warm-up, then that of
// the calls that close a keyframe, and the longest call of all.
#include <fcntl.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/latency/drive.hpp"
#include "ports/datasets/dataset.hpp"
#include "src/core/quantile.hpp"
#include "unimapper/onboard/owned_pipeline.hpp"

namespace {

using namespace unimapper;

int answers = -1;
int questions = -1;

/// Instructions executed so far, in place of nanoseconds; 0 without the plugin.
std::int64_t instructions() {
  constexpr unsigned long kCountRequest = 0x554D4943;
  ioctl(questions, kCountRequest);
  std::int64_t count = 0;
  return read(answers, &count, sizeof count) == sizeof count ? count : 0;
}

void open_pipe() {
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error("no pipe");
  answers = ends[0];
  questions = ends[1];
  // Reading must not wait for a plugin that is not there.
  fcntl(answers, F_SETFL, O_NONBLOCK);
  if (instructions() == 0)
    throw std::runtime_error("no instruction counter: run this by bench/arm/run.sh");
}

/// Instructions after the warm-up.
struct Counts {
  std::vector<double> stages[kStages];
  std::vector<double> closing_calls;
  double longest_call = 0.0;
};

/// Drives there and back until `keyframes` keyframes were counted, or once through the recording.
Counts count(const bench::Drive& drive, const SensorModel& sensor, bool there_and_back,
             std::uint32_t keyframes) {
  PipelineConfig config = preset(sensor.kind);
  config.clock_ns = instructions;
  OwnedPipeline pipeline(config);
  if (!pipeline.ok()) throw std::runtime_error(pipeline.error().message);

  const std::uint32_t warm_up = bench::warm_up_keyframes(config);
  const std::size_t longest = drive.longest(there_and_back, warm_up + keyframes);
  Counts counts;
  std::uint32_t closed = 0;
  for (std::size_t step = 0; step < longest; ++step) {
    if (there_and_back && closed == warm_up + keyframes) break;
    const bench::TimedScan scan = drive[step];
    const std::int64_t before = instructions();
    const ScanResult result =
        pipeline->add_scan(scan.points, scan.T_odometry_sensor, scan.stamp_ns);
    const auto call = static_cast<double>(instructions() - before);
    const bool counts_here = closed >= warm_up;
    if (counts_here) counts.longest_call = std::max(counts.longest_call, call);
    if (!result.keyframe_ready) continue;
    ++closed;
    if (!counts_here) continue;
    counts.closing_calls.push_back(call);
    const KeyframeStatistics& statistics = *pipeline->keyframe().statistics;
    for (std::size_t stage = 0; stage < kStages; ++stage) {
      counts.stages[stage].push_back(static_cast<double>(statistics.stage_us[stage]) * 1e3);
    }
  }
  if (counts.closing_calls.empty()) {
    throw std::runtime_error("the recording ends within the warm-up of " + std::to_string(warm_up) +
                             " keyframes: --there-and-back");
  }
  return counts;
}

}  // namespace

int main(int argc, char** argv) {
  std::string dataset;
  std::string sensor_name = "hdl-64e";
  bool there_and_back = false;
  std::uint32_t keyframes = 10;
  CLI::App app{
      "Median instructions of each stage over the keyframes after the warm-up, under qemu."};
  app.add_option("DATASET", dataset, "Recording to run through")->required();
  app.add_option("SENSOR", sensor_name, "LiDAR")->capture_default_str();
  app.add_flag("--there-and-back", there_and_back,
               "Forwards, backwards, forwards and so on: for short recordings");
  app.add_option("--keyframes", keyframes, "With it: keyframes after the warm-up")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  CLI11_PARSE(app, argc, argv);
  const SensorModel* const sensor = find_sensor(sensor_name);
  if (sensor == nullptr) {
    std::fprintf(stderr, "unknown sensor '%s'\n", sensor_name.c_str());
    return 1;
  }
  try {
    open_pipe();
    const bench::Drive drive(*datasets::open_dataset(dataset));
    Counts counts = count(drive, *sensor, there_and_back, keyframes);
    for (std::size_t stage = 0; stage < kStages; ++stage) {
      std::printf("%s %.0f\n", stage_name(static_cast<Stage>(stage)).data(),
                  median(std::span(counts.stages[stage])));
    }
    std::printf("closing-call %.0f\nlongest-call %.0f\n", median(std::span(counts.closing_calls)),
                counts.longest_call);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
  return 0;
}
