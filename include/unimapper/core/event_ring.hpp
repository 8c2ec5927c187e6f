// Single-producer, single-consumer ring of event records.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <new>
#include <span>

#include "unimapper/core/arena.hpp"
#include "unimapper/core/expected.hpp"

namespace unimapper {

/// One event. What the values mean follows from the id; unused ones are zero.
struct EventRecord {
  std::uint32_t id = 0;         ///< number of the event; the pipeline's are `EventId`
  std::uint32_t reserved = 0;   ///< 0
  std::int64_t stamp_ns = 0;    ///< of the scan at hand, or of the producer's clock
  std::int64_t values[4] = {};  ///< as the id defines them
};
static_assert(sizeof(EventRecord) == 48);

/// A lock-free ring of events in the caller's memory. One thread pushes, one thread pops, neither
/// ever waits; a full ring refuses the newest event and counts it, so the records that led to an
/// overload stay readable. No heap, no system calls. Cost: one copy and two atomic accesses per
/// call. Not usable across processes.
class EventRing {
 public:
  /// Bytes `create` takes for a ring of `capacity` records.
  static constexpr std::size_t required_bytes(std::uint32_t capacity) noexcept {
    return sizeof(EventRing) + std::size_t{capacity} * sizeof(EventRecord);
  }

  /// Lays a ring out in `memory` (64-byte aligned, at least `required_bytes`), which must outlive
  /// it. `capacity` must be a power of two up to 2^20.
  static Expected<EventRing*> create(std::uint32_t capacity, std::span<std::byte> memory) noexcept {
    if (capacity == 0 || capacity > (1U << 20U) || (capacity & (capacity - 1)) != 0) {
      return Error{ErrorCode::kInvalidConfig, "the ring's capacity must be a power of two to 2^20"};
    }
    if (reinterpret_cast<std::uintptr_t>(memory.data()) % Arena::kAlignment != 0) {
      return Error{ErrorCode::kMemoryMisaligned, "the memory must start on a 64-byte boundary"};
    }
    if (memory.size() < required_bytes(capacity)) {
      return Error{ErrorCode::kMemoryTooSmall,
                   "the memory is smaller than EventRing::required_bytes(capacity)"};
    }
    return new (memory.data()) EventRing(memory.data() + sizeof(EventRing), capacity);
  }

  EventRing(const EventRing&) = delete;
  EventRing& operator=(const EventRing&) = delete;

  /// Producer: appends a record. False, and counted, if the ring is full.
  bool push(const EventRecord& record) noexcept {
    const std::uint32_t head = head_.load(std::memory_order_relaxed);
    if (head - tail_.load(std::memory_order_acquire) == capacity_) {
      overflow_.fetch_add(1, std::memory_order_relaxed);
      return false;
    }
    records_[head & (capacity_ - 1)] = record;
    head_.store(head + 1, std::memory_order_release);
    return true;
  }

  /// Consumer: takes the oldest record. False if there is none.
  bool pop(EventRecord& out) noexcept {
    const std::uint32_t tail = tail_.load(std::memory_order_relaxed);
    if (tail == head_.load(std::memory_order_acquire)) return false;
    out = records_[tail & (capacity_ - 1)];
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }

  /// Records there is room for.
  [[nodiscard]] std::uint32_t capacity() const noexcept { return capacity_; }
  /// Records refused since the start; wraps at 2^32. Any thread.
  [[nodiscard]] std::uint32_t overflow() const noexcept {
    return overflow_.load(std::memory_order_relaxed);
  }

 private:
  EventRing(std::byte* storage, std::uint32_t capacity) noexcept
      : records_(new (storage) EventRecord[capacity]), capacity_(capacity) {}

  // Each side writes to a cache line of its own.
  alignas(64) std::atomic<std::uint32_t> head_{0};
  std::atomic<std::uint32_t> overflow_{0};
  alignas(64) std::atomic<std::uint32_t> tail_{0};
  alignas(64) EventRecord* records_;
  std::uint32_t capacity_;
};
static_assert(std::atomic<std::uint32_t>::is_always_lock_free);

}  // namespace unimapper
