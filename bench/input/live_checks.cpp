// Sayings of the calibration monitor while it runs through a recording
//
// live_checks RECORDING: a line for each part that is said, "PART SECONDS VALUE SIGMA", in the
// order of time; "motion SECONDS MISTAKE RATIO" for poses that neither mount nor delay explains.
// Keyframes of ten scans. The monitor alone runs: the other stages give it nothing
// (tests/onboard/calibration_monitor_test.cpp).
#include <cstdio>
#include <exception>
#include <memory>

#include "ports/datasets/dataset.hpp"
#include "src/onboard/calibration/calibration_monitor.hpp"
#include "unimapper/core/owned.hpp"

using namespace unimapper;
using onboard::CalibrationMonitor;

namespace {

void print(const CalibrationMonitor& monitor, std::uint8_t k, double seconds) {
  constexpr const char* kNames[] = {"roll", "pitch", "yaw", "x", "y", "z", "delay", "scale"};
  if (k == CalibrationMonitor::kMotion) {
    std::printf("motion %.1f %d %.3f\n", seconds, static_cast<int>(monitor.mistake()),
                monitor.length_ratio());
    return;
  }
  const Estimate& estimate = monitor.estimate(static_cast<CalibrationMonitor::Part>(k));
  std::printf("%s %.1f %.3f %.3f\n", kNames[k], seconds, estimate.value, estimate.sigma);
}

void run(const datasets::Dataset& dataset) {
  const PipelineConfig config;
  Arena measuring = Arena::measuring();
  auto monitor = std::make_unique<CalibrationMonitor>();
  monitor->allocate(measuring, config);
  const MemoryBlock memory(measuring.used());
  Arena arena(memory.span().data(), memory.span().size());
  monitor->allocate(arena, config);
  std::uint32_t said = 0;
  datasets::Scan scan;
  for (std::size_t i = 0; i < dataset.scan_count(); ++i) {
    dataset.read_scan(i, scan);
    monitor->add_scan(scan.view(), dataset.pose(i), dataset.stamp_ns(i));
    if ((i + 1) % config.keyframe.scans != 0) continue;
    while (monitor->step()) {
    }
    const double seconds = 1e-9 * static_cast<double>(dataset.stamp_ns(i) - dataset.stamp_ns(0));
    for (std::uint8_t k = 0; k < CalibrationMonitor::kParts; ++k) {
      if ((monitor->said() & ~said) >> k & 1U) print(*monitor, k, seconds);
    }
    said |= monitor->said();
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: live_checks RECORDING\n", stderr);
    return 2;
  }
  try {
    run(*datasets::open_dataset(argv[1]));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "live_checks: %s\n", error.what());
    return 1;
  }
  return 0;
}
