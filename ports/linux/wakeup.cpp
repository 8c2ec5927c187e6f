#include "ports/linux/wakeup.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <ctime>
#include <span>
#include <thread>
#include <vector>

#include "ports/linux/realtime.hpp"
#include "unimapper/core/quantile.hpp"

namespace unimapper::linux_port {

namespace {

constexpr std::int64_t kNanosecondsPerSecond = 1000000000;

std::int64_t now_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * kNanosecondsPerSecond + now.tv_nsec;
}

void sleep_until(std::int64_t at_ns) {
  timespec at{};
  at.tv_sec = static_cast<time_t>(at_ns / kNanosecondsPerSecond);
  at.tv_nsec = static_cast<long>(at_ns % kNanosecondsPerSecond);
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr) == EINTR) {
  }
}

/// `late_ns` has capacity for all wake-ups.
void sleep_and_note(std::int64_t interval_ns, std::int64_t duration_ns,
                    std::vector<std::int64_t>& late_ns) {
  const std::int64_t start = now_ns();
  std::int64_t due = start;
  while (true) {
    due += interval_ns;
    if (due > start + duration_ns) return;
    sleep_until(due);
    const std::int64_t now = now_ns();
    late_ns.push_back(now - due);
    if (now > due) due += (now - due) / interval_ns * interval_ns;
  }
}

double quantile_us(std::vector<std::int64_t>& late_ns, double share) {
  return 1e-3 * static_cast<double>(quantile(std::span(late_ns), share));
}

}  // namespace

WakeupLatency measure_wakeups(const WakeupOptions& options) {
  const std::int64_t interval_ns =
      std::chrono::duration_cast<std::chrono::nanoseconds>(options.interval).count();
  const std::int64_t duration_ns =
      std::chrono::duration_cast<std::chrono::nanoseconds>(options.duration).count();
  std::vector<std::int64_t> late_ns;
  if (interval_ns <= 0 || duration_ns < interval_ns) return {};
  // Written once, so that no page faults are measured.
  late_ns.assign(static_cast<std::size_t>(duration_ns / interval_ns) + 1, 1);
  late_ns.clear();
  WakeupLatency result;
  std::thread([&] {
    // Without pinning the figure is less exact, but better than none.
    static_cast<void>(pin_to_core(options.core));
    result.realtime = set_realtime_priority(options.priority).ok;
    sleep_and_note(interval_ns, duration_ns, late_ns);
  }).join();
  if (late_ns.empty()) return result;
  result.wakeups = late_ns.size();
  result.p50_us = quantile_us(late_ns, 0.5);
  result.p99_us = quantile_us(late_ns, 0.99);
  result.max_us = quantile_us(late_ns, 1.0);
  return result;
}

}  // namespace unimapper::linux_port
