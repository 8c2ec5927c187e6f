// Executor: parts of a task on several processors
#pragma once

#include <cstdint>

namespace unimapper {

/// Runs the parts of a task, several at once where the caller has processors for them. The library
/// starts no thread and takes no lock: who sets `run` brings both. Results are the same to the bit
/// with any number of workers and in any order of parts.
struct Executor {
  /// Part `part` of `task`. No part reads what another one writes. `worker`, below `workers`, names
  /// scratch memory: parts that run at the same time must get different ones.
  using Part = void (*)(void* task, std::uint32_t part, std::uint32_t worker);

  static constexpr std::uint32_t kMaxWorkers = 8;  ///< largest `workers`

  /// Calls `part(task, i, worker)` once for each i below `parts`, and returns when all calls have
  /// returned. They see what the calling thread wrote before, and it sees what they wrote. A worker
  /// that is late gets no part: others take them. Null: the calling thread does all in order.
  void (*run)(void* context, std::uint32_t parts, Part part, void* task) = nullptr;
  void* context = nullptr;    ///< handed to `run`
  std::uint32_t workers = 1;  ///< at most so many parts at once; [1, `kMaxWorkers`]
};

}  // namespace unimapper
