// Unit and origin of the times of points.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

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
  /// A number within that is no time; NaN: none.
  double unset = std::numeric_limits<double>::quiet_NaN();
  bool is_among_others = false;  ///< many numbers beside the range are of no sweep
  /// Numbers that are not finite say nothing.
  void add(double time);
  /// False of a number that is not finite.
  [[nodiscard]] bool contains(double time) const {
    return time >= least && time <= greatest && time != unset;
  }
  /// Negative while nothing was added.
  [[nodiscard]] double span() const { return greatest - least; }
};

/// The range of a scan's times that are of its sweep: those at most as far from the middle nine
/// tenths as these are wide. A driver's bug or an underflow gives single points any number. Where
/// half of the times lie in a twentieth of that, they are of the sweep, and so are those beside
/// them that lie nearly as densely. A number that a twentieth of the points has, and ten times as
/// many as any other, is one that the driver left unset.
[[nodiscard]] TimeRange sweep_range(std::vector<double> times);

/// The clock of a scan whose times cover `range` and whose stamp, where it has one of the points'
/// clock, is `stamp_ns`: a sweep takes 2 ms to 2 s, which is true in one unit only. Empty where no
/// unit fits.
[[nodiscard]] std::optional<PointClock> find_clock(const TimeRange& range,
                                                   std::optional<std::int64_t> stamp_ns);

/// The clock of a scan in a recording whose scans have times of `usual`, and cover `usual_span`
/// numbers as a rule. A scan that was cut keeps the usual unit; one that covers a thousand times
/// more or less has another. Empty where its times are all the same or fit no unit.
[[nodiscard]] std::optional<PointClock> find_clock_like(const PointClock& usual, double usual_span,
                                                        const TimeRange& range,
                                                        std::optional<std::int64_t> stamp_ns);

}  // namespace unimapper::datasets
