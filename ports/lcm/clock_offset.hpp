// Offset between the clocks of robot and base, from probes and their receipts.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "unimapper/wire/messages.hpp"

namespace unimapper::lcm_port {

/// Estimates the offset as NTP does: half the round trip is the most that a measurement can be
/// wrong by, and of the last eight the one with the smallest bound is taken, bounds growing by 100
/// ppm of their age (drift of two crystals). Measured is the base's clock against the robot's
/// steady one, so setting the robot's clock changes the offset at once and costs no measurement.
/// Where two successive measurements agree with each other and contradict the estimate, the base's
/// clock was set, and the filter starts over. Times are the caller's. O(1).
class ClockOffsetFilter {
 public:
  /// The robot's two clocks, read one after the other.
  struct RobotTime {
    std::int64_t steady_ns = 0;  ///< of any steady clock
    std::int64_t unix_ns = 0;    ///< Unix time
  };

  /// A probe was sent when the steady clock showed `sent_ns` and reached the base at
  /// `base_time_ns` of its clock; the round trip without the base's part took `round_trip_ns`.
  void add(std::int64_t sent_ns, std::int64_t base_time_ns, std::int64_t round_trip_ns);
  /// The offset now, if anything was measured. Counts a step of the robot's clock.
  std::optional<wire::ClockOffset> offset(const RobotTime& now);

 private:
  /// Base's time less the robot's steady time.
  struct Sample {
    std::int64_t at_ns = 0;  ///< steady time
    std::int64_t difference_ns = 0;
    std::int64_t bound_ns = 0;
  };

  [[nodiscard]] static std::int64_t bound_at(const Sample& sample, std::int64_t now_ns);
  [[nodiscard]] static bool agree(const Sample& a, const Sample& b);
  [[nodiscard]] const Sample* best(std::int64_t now_ns) const;

  static constexpr std::size_t kSamples = 8;
  std::array<Sample, kSamples> samples_{};
  std::size_t used_ = 0;
  std::size_t next_ = 0;
  std::optional<Sample> suspect_;               ///< the last one, if it contradicts the estimate
  std::optional<std::int64_t> robot_epoch_ns_;  ///< Unix time less steady time
  std::uint32_t steps_ = 0;
};

}  // namespace unimapper::lcm_port
