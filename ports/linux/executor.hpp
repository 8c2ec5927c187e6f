// Executor of Linux: threads that take parts of a task.
//
// Create the threads in the thread that runs the pipeline, after set_realtime_priority(), as they
// get its scheduling, and before pin_to_core() if their cores are not named. The object outlives
// the pipelines whose configuration has its executor():
//
//   WorkerThreads threads(std::array{2, 3});  // cores beside the pipeline's own
//   if (!threads.outcome().ok) std::puts(threads.outcome().message);
//   config.executor = threads.executor();
#pragma once

#include <pthread.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <span>

#include "ports/linux/realtime.hpp"
#include "unimapper/core/executor.hpp"

namespace unimapper::linux_port {

/// What `WorkerThreads` have done so far.
struct WorkerCounts {
  std::uint64_t tasks = 0;             ///< tasks that were offered to the threads
  std::uint64_t parts_by_threads = 0;  ///< parts of them that the calling thread did not do
  std::uint64_t waits = 0;             ///< tasks in which it waited for such a part
};

/// Threads that help the one that has a task. Each takes the next part that nobody has begun, and
/// so does the calling thread: one that is late costs nothing but its help. Only a part that a
/// thread has begun is waited for. Nothing is allocated and no lock is taken after construction. A
/// task of one caller at a time is shared; a caller that finds the threads busy does its own alone.
class WorkerThreads {
 public:
  static constexpr int kAnyCore = -1;  ///< any core that the creating thread may use

  /// Starts a thread on each of `cores`, counted from 0, with policy and priority of the calling
  /// thread. If one is refused none runs, and `outcome` says why.
  explicit WorkerThreads(std::span<const int> cores) noexcept;
  /// As many threads as make `workers` with the calling one, on any core.
  explicit WorkerThreads(std::uint32_t workers) noexcept;
  ~WorkerThreads() { stop(); }
  WorkerThreads(const WorkerThreads&) = delete;
  WorkerThreads& operator=(const WorkerThreads&) = delete;

  /// Whether the threads run, and if not what was refused.
  [[nodiscard]] const Outcome& outcome() const noexcept { return outcome_; }

  /// What a configuration takes. `workers` counts the calling thread: 1 if no thread runs.
  [[nodiscard]] Executor executor() noexcept;

  /// Ends the threads; later tasks are done by their callers alone. Not while a task runs.
  void stop() noexcept;

  /// For the thread that has the tasks.
  [[nodiscard]] const WorkerCounts& counts() const noexcept { return counts_; }

 private:
  Outcome start(std::span<const int> cores) noexcept;
  void work() noexcept;
  void run(std::uint32_t parts, Executor::Part part, void* task) noexcept;
  std::uint32_t take_parts(std::uint32_t worker) noexcept;
  void wait_for_threads(std::uint32_t own) noexcept;
  template <typename Condition>
  bool spin_until(Condition condition) const noexcept;

  // The task: written while no part is left and none runs, read by who has taken a part.
  Executor::Part part_ = nullptr;
  void* task_ = nullptr;
  std::uint32_t parts_ = 0;
  // Parts that nobody has begun, or kStop. Threads sleep while it is 0.
  alignas(64) std::atomic<std::uint32_t> left_ = 0;
  // Parts that are not done; the highest bit: the calling thread sleeps.
  alignas(64) std::atomic<std::uint32_t> unfinished_ = 0;
  alignas(64) std::atomic<std::uint32_t> asleep_ = 0;  // threads
  std::atomic<std::uint32_t> started_ = 0;
  std::atomic<bool> busy_ = false;
  bool spins_ = false;
  std::uint32_t threads_ = 0;
  std::array<pthread_t, Executor::kMaxWorkers - 1> handles_ = {};
  Outcome outcome_;
  WorkerCounts counts_;
};

}  // namespace unimapper::linux_port
