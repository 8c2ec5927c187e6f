// Wake-up latency measurement.
#pragma once

#include <chrono>
#include <cstddef>

namespace unimapper::linux_port {

/// How to measure.
struct WakeupOptions {
  std::chrono::milliseconds duration{2000};  ///< of the measurement
  std::chrono::microseconds interval{1000};  ///< from one wake-up to the next
  int priority = 80;                         ///< SCHED_FIFO, if granted
  int core = 0;                              ///< pinned to, if granted
};

/// Lateness of the wake-ups, microseconds.
struct WakeupLatency {
  std::size_t wakeups = 0;  ///< how many were measured
  bool realtime = false;    ///< the thread really had SCHED_FIFO
  double p50_us = 0.0;      ///< median
  double p99_us = 0.0;      ///< 99th percentile
  double max_us = 0.0;      ///< largest
};

/// Lets a thread sleep until absolute times, one `interval` apart, for `duration`, and records how
/// late it woke (as rt-tests' cyclictest). Blocks the caller; late wake-ups do not make
/// it longer, intervals missed altogether are skipped.
[[nodiscard]] WakeupLatency measure_wakeups(const WakeupOptions& options);

}  // namespace unimapper::linux_port
