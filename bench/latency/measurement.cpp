#include "measurement.hpp"

#include <time.h>

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <numeric>
#include <span>

#include "src/core/quantile.hpp"

namespace unimapper::bench {
namespace {

[[gnu::format(printf, 1, 2)]] std::string format(const char* pattern, ...) {
  char line[256];
  va_list values;
  va_start(values, pattern);
  std::vsnprintf(line, sizeof line, pattern, values);
  va_end(values);
  return line;
}

/// A row of the table; without `is_steady` only of the warm-up.
std::string row(std::string_view name, std::vector<double> steady_ms,
                std::vector<double> warm_up_ms, bool is_steady) {
  const Percentiles steady = percentiles(std::move(steady_ms));
  const Percentiles warm_up = percentiles(std::move(warm_up_ms));
  std::string text = "| " + std::string(name) + " |";
  for (const double ms : {steady.p50, steady.p90, steady.p99, steady.max}) {
    text += is_steady ? format(" %.2f |", ms) : " – |";
  }
  return text + format(" %.2f | %.2f |\n", warm_up.p50, warm_up.max);
}

std::int64_t time_ns(clockid_t clock) noexcept {
  timespec now{};
  clock_gettime(clock, &now);
  return now.tv_sec * std::int64_t{1000000000} + now.tv_nsec;
}

}  // namespace

std::int64_t processor_time_ns() noexcept { return time_ns(CLOCK_THREAD_CPUTIME_ID); }

std::int64_t wall_time_ns() noexcept { return time_ns(CLOCK_MONOTONIC); }

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
  Measurement& measurement = keyframes_ < warm_up_ ? measurement_.warm_up : measurement_.steady;
  measurement.calls.push_back(
      {static_cast<double>(end_ns - start_ns) * 1e-6, result.keyframe_ready, step_++, keyframes_});
  if (result.keyframe_finished) measurement.add(*pipeline_.finished_keyframe().statistics);
  if (!result.keyframe_ready) return false;
  ++keyframes_;
  return true;
}

std::string to_table(const SplitMeasurement& times, const std::string& title) {
  const Measurement& steady = times.steady;
  const Measurement& warm_up = times.warm_up;
  const bool is_steady = times.is_steady();
  std::string table =
      format("\n| %s: ms | p50 | p90 | p99 | max | warm-up: p50 | max |\n", title.c_str()) +
      "|---|---|---|---|---|---|---|\n";
  for (std::size_t i = 0; i < kStages; ++i) {
    table +=
        row(stage_name(static_cast<Stage>(i)), steady.stage_ms[i], warm_up.stage_ms[i], is_steady);
  }
  table += row("every call", steady.calls_ms(), warm_up.calls_ms(), is_steady);
  table += row("closing call", steady.calls_ms(true), warm_up.calls_ms(true), is_steady);
  table += row("other calls", steady.calls_ms(false), warm_up.calls_ms(false), is_steady);
  if (!is_steady) {
    return table + format(
                       "\nToo short for a steady state: %zu keyframes after the %zu of the "
                       "warm-up, and it takes %zu (--there-and-back).\n",
                       steady.keyframes(), warm_up.keyframes(), kLeastKeyframes);
  }
  const Call& longest = steady.longest_call();
  table +=
      format("\nThe longest call took %.2f ms: scan %zu of the drive, %s keyframe %u.\n",
             longest.ms, longest.step, longest.closes ? "which closes" : "in", longest.keyframe);
  return table + format("%.1f M points/s ingested, %.1f M points/s in all.\n",
                        steady.points_per_second(Stage::kIngest) * 1e-6,
                        steady.points_per_second(Stage::kTotal) * 1e-6);
}

}  // namespace unimapper::bench
