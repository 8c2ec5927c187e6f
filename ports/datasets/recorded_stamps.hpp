// Stamps against the order of recording.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "ports/datasets/dataset.hpp"

namespace unimapper::datasets {

/// From one stamp on, all stamps are of a clock that was set to another time.
struct ClockStep {
  std::size_t first = 0;      ///< the first stamp behind the step
  std::int64_t by_ns = 0;     ///< forwards where positive
  std::int64_t log_ns = 0;    ///< when the first stamp behind it was recorded
  bool is_of_others = false;  ///< the stamps of another topic step with it
};

/// What contradicts the order of recording.
struct RecordedStamps {
  std::vector<bool> is_glitch;   ///< a stamp alone out of order, while those around it are in order
  std::vector<ClockStep> steps;  ///< in order
  std::size_t glitches = 0;      ///< of `is_glitch`
  std::size_t first_glitch = 0;  ///< where there is one

  /// Stamp `i`, which is `stamp_ns`, by a clock that does not step: own steps are taken back to the
  /// clock of the longest run of stamps without one, those of other topics to that of the start.
  [[nodiscard]] std::int64_t without_steps(std::size_t i, std::int64_t stamp_ns) const;
};

/// Compares stamps, in the order in which they were recorded, with the times of recording, or with
/// an even rate where `log_ns` is empty (then only steps back are told: a step forward looks like
/// a gap). A scan that was recorded late, but whose stamp fits between the others, is none of
/// either. Nothing is concluded where a tenth of the stamps is out of order. O(n log n).
[[nodiscard]] RecordedStamps check_recorded_stamps(std::span<const std::int64_t> stamps_ns,
                                                   std::span<const std::int64_t> log_ns);

/// Compares the stamps of records, each with a `stamp_ns` and a `log_ns`, as
/// `check_recorded_stamps` does.
template <typename Records>
[[nodiscard]] RecordedStamps check_stamps_of(const Records& records) {
  std::vector<std::int64_t> stamps_ns;
  std::vector<std::int64_t> log_ns;
  for (const auto& record : records) {
    stamps_ns.push_back(record.stamp_ns);
    log_ns.push_back(record.log_ns);
  }
  return check_recorded_stamps(stamps_ns, log_ns);
}

/// Says what was found: `what` has a stamp, e.g. "scan"; `whose` are they, e.g. a topic.
void note_stamps(const RecordedStamps& found, const std::string& what, const std::string& whose,
                 std::vector<Note>& notes);

/// Marks the steps that both have, and makes them of the size of `a`, which has more stamps.
void find_common_steps(RecordedStamps& a, RecordedStamps& b);

}  // namespace unimapper::datasets
