// Times of arrival by both clocks, from LCM's time of arrival.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>

#include "unimapper/wire/messages.hpp"

namespace unimapper::lcm_port {

/// LCM notes the Unix time in µs at which a message came from the kernel. Of the steady clock it is
/// as long ago as by the other one; more than a second means that the clock was set meanwhile.
inline wire::ProbeArrival arrival_of(std::int64_t unix_us) {
  using std::chrono::nanoseconds;
  constexpr std::int64_t kLongestAgoNs = 1000000000;
  const std::int64_t steady =
      nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count();
  const std::int64_t unix_now =
      nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count();
  const std::int64_t ago = unix_now - unix_us * 1000;
  if (ago < 0 || ago > kLongestAgoNs) return {steady, unix_now};
  return {steady - ago, unix_now - ago};
}

}  // namespace unimapper::lcm_port
