// Reports of the link between robot and base: what arrived, how much may be sent, whose time it is.
#pragma once

#include <cstdint>
#include <optional>

#include "unimapper/core/session_id.hpp"

namespace unimapper::wire {

/// By how much the base's clock is ahead of the robot's.
struct ClockOffset {
  std::int64_t base_minus_robot_ns = 0;  ///< add it to the robot's time to get the base's
  std::int64_t uncertainty_ns = 0;       ///< the offset is wrong by at most so much
  std::uint32_t steps = 0;               ///< how often either clock was set since the start
};

/// From the robot: asks the base what has arrived so far, and for its time.
struct ProbeMessage {
  SessionId session;                   ///< whose
  std::uint32_t number = 0;            ///< from 1, one more with each probe of the session
  std::int64_t robot_time_ns = 0;      ///< when it was sent, Unix time by the robot's clock
  std::uint64_t bytes_per_second = 0;  ///< at which the robot sends keyframes
  std::optional<ClockOffset> clock;    ///< what is known of the clocks so far
};

/// Windows are never smaller: one datagram of the largest size.
inline constexpr std::uint64_t kSmallestWindow = 65536;

/// From the base: the answer to a probe.
struct ReceiptMessage {
  SessionId session;              ///< whose probe it answers
  std::uint64_t base = 0;         ///< random number of the base's start
  std::uint32_t number = 0;       ///< of the probe
  std::int64_t base_time_ns = 0;  ///< when the probe arrived, Unix time, base's clock
  std::int64_t held_ns = 0;       ///< from then until this was sent
  std::uint64_t pieces = 0;       ///< of the session, arrived before the probe
  std::uint64_t window_bytes = kSmallestWindow;  ///< pieces the robot may have on the way
};

/// When a probe arrived, by the base's clocks.
struct ProbeArrival {
  std::int64_t steady_ns = 0;  ///< of any steady clock
  std::int64_t unix_ns = 0;    ///< Unix time
};

}  // namespace unimapper::wire
