#include "measurement.hpp"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <span>

#include "unimapper/core/quantile.hpp"

namespace unimapper::bench {
namespace {

std::int64_t time_of(clockid_t clock) noexcept {
  timespec now{};
  clock_gettime(clock, &now);
  return now.tv_sec * std::int64_t{1000000000} + now.tv_nsec;
}

}  // namespace

std::int64_t processor_time_ns() noexcept { return time_of(CLOCK_THREAD_CPUTIME_ID); }
std::int64_t wall_time_ns() noexcept { return time_of(CLOCK_MONOTONIC); }

Percentiles percentiles(std::vector<double> values) {
  if (values.empty()) return {};
  const auto at = [&values](double share) { return quantile(std::span(values), share); };
  return {at(0.5), at(0.9), at(0.99), at(1.0)};
}

void Measurement::add(const KeyframeStatistics& statistics) {
  points += statistics.points_in;
  for (std::size_t i = 0; i < kStages; ++i) {
    stage_ms[i].push_back(static_cast<double>(statistics.stage_us[i]) * 1e-3);
  }
  for (std::size_t i = 0; i < kDropCauses; ++i) dropped[i] += statistics.dropped[i];
}

std::vector<double> Measurement::calls_ms() const {
  std::vector<double> times_ms;
  for (const Call& call : calls) times_ms.push_back(call.ms);
  return times_ms;
}

std::vector<double> Measurement::calls_ms(bool closing) const {
  std::vector<double> times_ms;
  for (const Call& call : calls) {
    if (call.closes == closing) times_ms.push_back(call.ms);
  }
  return times_ms;
}

const Call& Measurement::longest_call() const {
  return *std::max_element(calls.begin(), calls.end(),
                           [](const Call& a, const Call& b) { return a.ms < b.ms; });
}

double Measurement::points_per_second(Stage stage) const {
  const std::vector<double>& times_ms = stage_ms[static_cast<std::size_t>(stage)];
  const double sum_ms = std::accumulate(times_ms.begin(), times_ms.end(), 0.0);
  return sum_ms > 0.0 ? static_cast<double>(points) / (sum_ms * 1e-3) : 0.0;
}

Feeder::Feeder(Pipeline& pipeline, const PipelineConfig& config, SplitMeasurement& measurement)
    : pipeline_(pipeline),
      clock_ns_(config.clock_ns),
      measurement_(measurement),
      warm_up_(warm_up_keyframes(config)) {}

bool Feeder::feed(const TimedScan& scan) {
  const std::int64_t start_ns = clock_ns_();
  const ScanResult result = pipeline_.add_scan(scan.points, scan.T_odometry_sensor, scan.stamp_ns);
  const std::int64_t end_ns = clock_ns_();
  if (result.error.code != ErrorCode::kOk) {
    std::fprintf(stderr, "scan at %lld ns: %s\n", static_cast<long long>(scan.stamp_ns),
                 result.error.message);
  }
  Measurement& measurement = current();
  measurement.calls.push_back(
      {static_cast<double>(end_ns - start_ns) * 1e-6, result.keyframe_ready, step_++, keyframes_});
  if (result.keyframe_finished) measurement.add(*pipeline_.finished_keyframe().statistics);
  if (!result.keyframe_ready) return false;
  ++keyframes_;
  return true;
}

}  // namespace unimapper::bench
