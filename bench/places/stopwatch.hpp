// Processor-time clock of a thread.
#pragma once

#include <time.h>

namespace unimapper::bench {

/// Processor time of the calling thread, milliseconds: other load does not count.
inline double thread_milliseconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

}  // namespace unimapper::bench
