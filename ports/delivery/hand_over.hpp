// Queue of encoded keyframes from a thread with deadlines to one of its own.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <semaphore>
#include <thread>
#include <vector>

#include "unimapper/wire/byte_io.hpp"

namespace unimapper::delivery {

/// Copies bytes into memory that was taken before and hands them on from its own thread, in order.
class HandOver {
 public:
  /// Takes what was put in, on the thread. What it throws is counted and forgotten.
  using Take = std::function<void(wire::Bytes keyframe, std::int64_t stamp_ns)>;

  /// Takes and touches all memory: `slots` keyframes of at most `slot_bytes`. Throws
  /// std::bad_alloc.
  HandOver(std::size_t slots, std::size_t slot_bytes, Take take);
  /// Hands on what waits.
  ~HandOver();
  HandOver(const HandOver&) = delete;
  HandOver& operator=(const HandOver&) = delete;

  /// Copies a keyframe; false if it is larger than a slot or no slot is free. No heap, no lock, no
  /// wait; at most one system call, which wakes the thread. For one thread.
  [[nodiscard]] bool put(wire::Bytes keyframe, std::int64_t stamp_ns) noexcept;
  /// Hands on what waits, and ends the thread. Nothing may be put in any more.
  void finish() noexcept;
  /// Keyframes that `Take` threw for. Thread safe.
  [[nodiscard]] std::uint64_t failed() const { return failed_.load(std::memory_order_relaxed); }

 private:
  struct Slot {
    std::vector<std::uint8_t> memory;
    std::size_t bytes = 0;
    std::int64_t stamp_ns = 0;
  };

  void run();

  std::vector<Slot> slots_;
  const Take take_;
  std::atomic<std::uint64_t> put_{0};    ///< keyframes put in so far
  std::atomic<std::uint64_t> taken_{0};  ///< keyframes handed on so far
  std::atomic<std::uint64_t> failed_{0};
  std::atomic<bool> finishing_{false};
  std::counting_semaphore<> queued_{0};
  std::thread thread_;
};

}  // namespace unimapper::delivery
