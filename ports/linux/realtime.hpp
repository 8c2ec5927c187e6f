// Real-time set-up of a Linux thread: locked memory, priority, affinity, prefaulting.
//
// Call these once, while the robot starts; none belongs into the control loop. Order that works:
// lock_memory(); then in the thread that runs the pipeline set_realtime_priority(), start
// WorkerThreads if there are any (they take over the priority), pin_to_core(), get the pipeline's
// block, prefault(block), create the pipeline.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace unimapper::linux_port {

/// Whether Linux granted something. `message` is a constant sentence that says what was refused
/// and what to do about it, "" if all is well; `error_number` is errno's value.
struct Outcome {
  bool ok = true;            ///< it was granted
  int error_number = 0;      ///< errno, 0 if granted
  const char* message = "";  ///< what was refused, and the remedy
};

/// Keeps all pages of the process in memory, present and future ones (mlockall), so that none is
/// ever written out or fetched back. Needs CAP_IPC_LOCK or RLIMIT_MEMLOCK above the process size.
[[nodiscard]] Outcome lock_memory() noexcept;

/// Undoes lock_memory().
void unlock_memory() noexcept;

/// Touches every page of `memory` without changing its contents, so that the first use later does
/// not fault. Refuses an empty span. Cost: one or two page faults per page that is not yet present.
Outcome prefault(std::span<std::byte> memory) noexcept;

/// Gives the calling thread SCHED_FIFO with `priority` (1, lowest, to 99): it runs until it waits
/// or something more urgent comes. Stay below 90, where the kernel's own threads begin to matter.
/// Needs CAP_SYS_NICE or an RLIMIT_RTPRIO of at least `priority`.
[[nodiscard]] Outcome set_realtime_priority(int priority) noexcept;

/// Keeps the calling thread on core `core`, counted from 0.
[[nodiscard]] Outcome pin_to_core(int core) noexcept;

/// Page faults of the calling thread so far. After lock_memory() and prefault() the number must
/// not grow in the control loop.
[[nodiscard]] std::int64_t page_faults() noexcept;

}  // namespace unimapper::linux_port
