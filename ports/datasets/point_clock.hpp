// Unit and origin of the times of points.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>

namespace unimapper::datasets {

/// What the numbers of a scan's time field mean.
struct PointClock {
  /// Where the numbers count from.
  enum class Zero : std::uint8_t {
    kStamp,  ///< they count from the scan's stamp
    kEpoch,  ///< they are stamps themselves
    kOwn,    ///< another clock: they count from the scan's first point
  };
  /// Of one step of the numbers.
  double seconds_per_unit = 1.0;
  /// Of this scan.
  Zero zero = Zero::kStamp;
};

/// Least and greatest number of a scan's time field.
struct TimeRange {
  /// Above `greatest` while nothing was added.
  double least = std::numeric_limits<double>::infinity();
  /// Below `least` while nothing was added.
  double greatest = -std::numeric_limits<double>::infinity();
  /// Numbers that are not finite say nothing.
  void add(double time);
};

/// The clock of a scan whose times cover `range` and whose stamp, where it has one of the points'
/// clock, is `stamp_ns`: a sweep takes 2 ms to 2 s, which is true in one unit only. Empty where no
/// unit fits.
[[nodiscard]] std::optional<PointClock> find_clock(const TimeRange& range,
                                                   std::optional<std::int64_t> stamp_ns);

}  // namespace unimapper::datasets
