#include "ports/datasets/point_clock.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "src/core/quantile.hpp"

namespace unimapper::datasets {

void TimeRange::add(double time) {
  if (!std::isfinite(time)) return;
  least = std::min(least, time);
  greatest = std::max(greatest, time);
}

TimeRange sweep_range(std::vector<double> times) {
  std::erase_if(times, [](double time) { return !std::isfinite(time); });
  TimeRange range;
  if (times.empty()) return range;
  const double low = quantile(std::span(times), 0.05);
  const double high = quantile(std::span(times), 0.95);
  for (const double time : times) {
    if (time >= low - (high - low) && time <= high + (high - low)) range.add(time);
  }
  return range;
}

namespace {

constexpr double kShortestScan_s = 0.002;
constexpr double kLongestScan_s = 2.0;

PointClock::Zero zero_of(const TimeRange& range, double unit_s,
                         std::optional<std::int64_t> stamp_ns) {
  constexpr double kNanosecond_s = 1e-9;
  const double begin_s = range.least * unit_s;
  if (std::abs(begin_s) <= kLongestScan_s) return PointClock::Zero::kStamp;
  const bool is_stamp =
      stamp_ns.has_value() &&
      std::abs(begin_s - static_cast<double>(*stamp_ns) * kNanosecond_s) <= kLongestScan_s;
  return is_stamp ? PointClock::Zero::kEpoch : PointClock::Zero::kOwn;
}

}  // namespace

std::optional<PointClock> find_clock(const TimeRange& range, std::optional<std::int64_t> stamp_ns) {
  constexpr std::array<double, 4> kUnits_s = {1.0, 1e-3, 1e-6, 1e-9};
  for (const double unit_s : kUnits_s) {
    const double span_s = range.span() * unit_s;
    if (!(span_s >= kShortestScan_s && span_s < kLongestScan_s)) continue;
    return PointClock{unit_s, zero_of(range, unit_s, stamp_ns)};
  }
  return std::nullopt;
}

std::optional<PointClock> find_clock_like(const PointClock& usual, double usual_span,
                                          const TimeRange& range,
                                          std::optional<std::int64_t> stamp_ns) {
  const double span = range.span();
  if (!(span > 0.0)) return std::nullopt;
  for (const double factor : {1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9}) {
    const double ratio = span / (usual_span * factor);
    if (ratio > 0.5 && ratio < 2.0) return find_clock(range, stamp_ns);
  }
  if (span * usual.seconds_per_unit >= kLongestScan_s) return std::nullopt;
  PointClock clock = usual;
  if (usual.zero != PointClock::Zero::kOwn) {
    clock.zero = zero_of(range, usual.seconds_per_unit, stamp_ns);
  }
  return clock;
}

}  // namespace unimapper::datasets
