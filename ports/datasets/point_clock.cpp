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

namespace {

/// A few thousand times, in order: sorting all would take longer than reading them.
std::vector<double> sorted_sample(const std::vector<double>& times) {
  constexpr std::size_t kMost = 4000;
  const std::size_t step = times.size() / kMost + 1;
  std::vector<double> sample;
  // Another point of every `step` each time: a stride may meet one laser alone.
  for (std::size_t k = 0; k < times.size() / step; ++k)
    sample.push_back(times[k * step + k % step]);
  std::sort(sample.begin(), sample.end());
  return sample;
}

/// The shortest interval that holds half of the times, which are in order.
TimeRange shortest_half(const std::vector<double>& times) {
  const std::size_t half = times.size() / 2;
  TimeRange shortest{times.front(), times.back()};
  for (std::size_t i = 0; i + half < times.size(); ++i) {
    if (times[i + half] - times[i] < shortest.span()) shortest = {times[i], times[i + half]};
  }
  return shortest;
}

/// `half` and what beside it, up to as long again on either side, holds times nearly as densely.
TimeRange grown(const TimeRange& half, const std::vector<double>& times) {
  constexpr int kSteps = 24;      // of a twentieth: the other half of the sweep, and a little
  constexpr double kDense = 0.2;  // of the density of the half
  const double step = half.span() / 20.0;
  const double fewest = kDense * 0.5 * static_cast<double>(times.size()) / 20.0;
  const auto count = [&](double from, double to) {
    const auto first = std::lower_bound(times.begin(), times.end(), from);
    return static_cast<double>(std::upper_bound(first, times.end(), to) - first);
  };
  TimeRange sweep = half;
  for (int k = 1; k <= kSteps; ++k) {
    const double down = half.least - step * k;
    if (count(down, down + step) >= fewest) sweep.least = down;
    const double up = half.greatest + step * k;
    if (count(up - step, up) >= fewest) sweep.greatest = up;
  }
  return sweep;
}

/// The number that was left unset, of times in order; NaN: none.
double unset_number(const std::vector<double>& times) {
  constexpr std::size_t kFewest = 20;  // other numbers
  constexpr std::size_t kOfPoints = 20;
  constexpr std::size_t kAsMany = 10;  // as of any other: lasers fire together
  std::size_t most = 0;
  std::size_t second = 0;
  std::size_t others = 0;
  double number = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t i = 0; i < times.size(); ++others) {
    std::size_t end = i;
    while (end < times.size() && times[end] == times[i]) ++end;
    second = std::max(second, std::min(most, end - i));
    if (end - i > most) number = times[i];
    most = std::max(most, end - i);
    i = end;
  }
  const bool is_unset =
      others > kFewest && kOfPoints * most > times.size() && most > kAsMany * second;
  return is_unset ? number : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

TimeRange sweep_range(std::vector<double> times) {
  // A LiDAR that sees something in a tenth of its turn still spreads its times over that.
  constexpr double kWidest = 20.0;
  std::erase_if(times, [](double time) { return !std::isfinite(time); });
  TimeRange range;
  if (times.empty()) return range;
  std::vector<double> sample = sorted_sample(times);
  range.unset = unset_number(sample);
  std::erase(sample, range.unset);
  std::erase(times, range.unset);
  if (times.empty() || sample.empty()) return range;
  const TimeRange half = shortest_half(sample);
  const TimeRange middle{quantile(std::span(times), 0.05), quantile(std::span(times), 0.95)};
  // Times that are all the same are no sweep.
  if (half.span() > 0.0 && middle.span() > kWidest * half.span()) {
    const TimeRange sweep = grown(half, sample);
    range.least = sweep.least;
    range.greatest = sweep.greatest;
    range.is_among_others = true;
    return range;
  }
  const double reach = middle.span();
  for (const double time : times) {
    if (time >= middle.least - reach && time <= middle.greatest + reach) range.add(time);
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
