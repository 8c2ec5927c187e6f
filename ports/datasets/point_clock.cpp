#include "ports/datasets/point_clock.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace unimapper::datasets {

void TimeRange::add(double time) {
  if (!std::isfinite(time)) return;
  least = std::min(least, time);
  greatest = std::max(greatest, time);
}

std::optional<PointClock> find_clock(const TimeRange& range, std::optional<std::int64_t> stamp_ns) {
  constexpr double kShortestScan_s = 0.002;
  constexpr double kLongestScan_s = 2.0;
  constexpr double kNanosecond_s = 1e-9;
  constexpr std::array<double, 4> kUnits_s = {1.0, 1e-3, 1e-6, kNanosecond_s};
  const double span = range.greatest - range.least;
  for (const double unit_s : kUnits_s) {
    const double span_s = span * unit_s;
    if (!(span_s >= kShortestScan_s && span_s < kLongestScan_s)) continue;
    const double begin_s = range.least * unit_s;
    if (std::abs(begin_s) <= kLongestScan_s) return PointClock{unit_s, PointClock::Zero::kStamp};
    const bool is_stamp =
        stamp_ns.has_value() &&
        std::abs(begin_s - static_cast<double>(*stamp_ns) * kNanosecond_s) <= kLongestScan_s;
    return PointClock{unit_s, is_stamp ? PointClock::Zero::kEpoch : PointClock::Zero::kOwn};
  }
  return std::nullopt;
}

}  // namespace unimapper::datasets
