// Command-line tool: instructions per keyframe and stage, counted by qemu.
//
// Runs in qemu's user mode with the plugin of count_instructions.c; run.sh does that for every
// processor.
//
//   stage_instructions DATASET [SENSOR]
//
// Prints the name of each stage and the median over all keyframes but the first, which has no
// earlier evidence.
#include <fcntl.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "ports/datasets/dataset.hpp"
#include "unimapper/core/quantile.hpp"
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

/// Instructions of every keyframe but the first, per stage.
using Counts = std::vector<double>[kStages];

void run(const datasets::Dataset& dataset, const SensorModel& sensor, Counts& counts) {
  PipelineConfig config = preset(sensor.kind);
  config.clock_ns = instructions;
  OwnedPipeline pipeline(config);
  if (!pipeline.ok()) throw std::runtime_error(pipeline.error().message);

  datasets::Scan scan;
  for (std::size_t i = 0; i < dataset.scan_count(); ++i) {
    dataset.read_scan(i, scan);
    const ScanResult result = pipeline->add_scan(scan.view(), dataset.pose(i), dataset.stamp_ns(i));
    if (!result.keyframe_ready || pipeline->keyframe().sequence == 0) continue;
    const KeyframeStatistics& statistics = *pipeline->keyframe().statistics;
    for (std::size_t stage = 0; stage < kStages; ++stage) {
      counts[stage].push_back(static_cast<double>(statistics.stage_us[stage]) * 1e3);
    }
  }
  if (counts[0].empty()) throw std::runtime_error("fewer than two keyframes");
}

}  // namespace

int main(int argc, char** argv) {
  std::string dataset;
  std::string sensor_name = "hdl-64e";
  CLI::App app{"Median instructions of each stage over the keyframes of a recording, under qemu."};
  app.add_option("DATASET", dataset, "Recording to run through")->required();
  app.add_option("SENSOR", sensor_name, "LiDAR")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  const SensorModel* const sensor = find_sensor(sensor_name);
  if (sensor == nullptr) {
    std::fprintf(stderr, "unknown sensor '%s'\n", sensor_name.c_str());
    return 1;
  }
  try {
    open_pipe();
    Counts counts;
    run(*datasets::open_dataset(dataset), *sensor, counts);
    for (std::size_t stage = 0; stage < kStages; ++stage) {
      std::printf("%s %.0f\n", stage_name(static_cast<Stage>(stage)).data(),
                  median(std::span(counts[stage])));
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
  return 0;
}
