// Worker threads whose parts are watched as the pipeline's own calls are.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>

#include "ports/linux/executor.hpp"

namespace unimapper::test {

/// `Scope` lives on a thread while that has a part. The calling thread, which has a scope of its
/// own, leaves the threads a millisecond to begin one, so that they do help.
template <typename Scope>
class WatchedWorkers {
 public:
  explicit WatchedWorkers(std::uint32_t workers) : threads_(workers) {}

  [[nodiscard]] Executor executor() noexcept {
    const auto run = [](void* self, std::uint32_t parts, Executor::Part part, void* task) {
      const Executor threads = static_cast<WatchedWorkers*>(self)->threads_.executor();
      Task watched{part, task, Clock::now() + std::chrono::milliseconds(1)};
      threads.run(threads.context, parts, Task::run, &watched);
    };
    return {run, this, threads_.executor().workers};
  }
  [[nodiscard]] const linux_port::WorkerCounts& counts() const noexcept {
    return threads_.counts();
  }

 private:
  using Clock = std::chrono::steady_clock;
  struct Task {
    Executor::Part part;
    void* task;
    Clock::time_point end_of_waiting;
    std::atomic<bool> is_helped = false;

    static void run(void* self, std::uint32_t number, std::uint32_t worker) {
      Task& watched = *static_cast<Task*>(self);
      if (worker == 0) {
        while (!watched.is_helped && Clock::now() < watched.end_of_waiting) {
        }
        return watched.part(watched.task, number, worker);
      }
      watched.is_helped = true;
      const Scope scope;
      watched.part(watched.task, number, worker);
    }
  };

  linux_port::WorkerThreads threads_;
};

}  // namespace unimapper::test
