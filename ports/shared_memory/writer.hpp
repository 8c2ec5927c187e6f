// Writer of a topic: messages into a ring of chunks in shared memory.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "ports/shared_memory/segment.hpp"

namespace unimapper::shared_memory {

/// Whose processes may read.
enum class Audience : std::uint8_t { kSameUser, kSameGroup, kEveryone };

/// Size of a topic.
struct WriterOptions {
  std::uint32_t message_bytes = 1U << 20U;  ///< room for the largest message; 1 to 2^28
  std::uint32_t consumers = 4;              ///< at a time, 1 to 16
  std::uint32_t leases = 2;                 ///< messages that one consumer may hold, 1 to 8
  /// Messages kept for consumers that are late, besides those that are leased; at least 1. There
  /// are consumers x leases + 1 + history chunks, at most 256.
  std::uint32_t history = 1;
  std::uint32_t content = 0;  ///< what the messages are; readers must ask for the same
  Audience audience = Audience::kSameUser;  ///< whose processes may read
};

/// What a consumer is doing, by its own account, and what it holds.
struct ConsumerState {
  bool present = false;       ///< a process owns the slot
  std::uint32_t leases = 0;   ///< chunks it holds
  std::uint32_t process = 0;  ///< its process id in its own namespace
  std::uint32_t taken = 0;    ///< sequence of the message it took last
  std::uint32_t missed = 0;   ///< messages it never saw
};

/// Publishes messages without copying and without waiting: there is always a chunk that nobody
/// holds. After `open`: no heap and no lock; `loan` reads each consumer's 64 bytes (one system
/// call each, two where a lease came between; none sleeps), `publish` wakes who waits (one system
/// call). Not thread safe. Its memory outlives it: the next writer goes on with it, and consumers
/// keep what they hold.
class Writer {
 public:
  /// Becomes the writer of `topic` of `share` (see `is_share_name`), unless there is one that
  /// lives. Takes the segment of an earlier one over if it has the same shape, or makes a new one:
  /// all memory is taken here. For the start of a program; nothing here is real time.
  Outcome open(std::string_view share, std::string_view topic,
               const WriterOptions& options = {}) noexcept;
  /// Whether it is the writer of a topic.
  [[nodiscard]] bool is_open() const noexcept { return mapping_.data() != nullptr; }

  /// Memory for the next message, as many bytes as a message may have, starting on a page; the same
  /// until it is published. It holds an old message. Empty only before `open`, and after 2^32 - 1
  /// messages (13 years at 10 a second).
  [[nodiscard]] std::span<std::byte> loan() noexcept;
  /// Publishes the first `bytes` of what was loaned, of time `stamp_ns`, and wakes who waits.
  /// Returns the message's sequence; 0 if nothing was loaned or it does not hold so many bytes.
  std::uint32_t publish(std::size_t bytes, std::int64_t stamp_ns) noexcept;

  /// Sequence of the message published last, by whichever writer; 0: none.
  [[nodiscard]] std::uint32_t latest() const noexcept;
  /// Sleeps until `latest` is no longer `seen`, at most `timeout_ns`, and returns it. For one other
  /// thread of this program, which announces messages elsewhere (`lcm_port::Doorbell`): it costs
  /// the thread that publishes nothing. Not beside `open` and `remove`.
  [[nodiscard]] std::uint32_t wait_beyond(std::uint32_t seen,
                                          std::int64_t timeout_ns) const noexcept;

  /// Leases of consumers that no longer live are given back, and their number is returned. Such
  /// leases never hinder the writer; they shorten the history that late consumers find. Not for the
  /// real-time thread.
  std::uint32_t reclaim() noexcept;
  /// From now on what consumer `slot` holds may be overwritten. It may take anew. `Sample::intact`
  /// tells it.
  void revoke(std::uint32_t slot) noexcept;
  /// State of the consumer in `slot`, below `WriterOptions::consumers`. Not for the real-time
  /// thread.
  [[nodiscard]] ConsumerState consumer(std::uint32_t slot) const noexcept;
  /// Slots for consumers.
  [[nodiscard]] std::uint32_t slots() const noexcept { return shape_.consumers; }

  /// Takes the topic's files out of /dev/shm; who has them open keeps them. The writer is closed.
  void remove() noexcept;

 private:
  static constexpr std::uint32_t kNone = ~0U;
  /// One bit per chunk.
  using ChunkSet = std::array<std::uint32_t, kMaxChunks / 32>;

  Outcome lock(std::string_view share, std::string_view topic) noexcept;
  Outcome open_slots(std::string_view share, std::string_view topic, unsigned permissions) noexcept;
  Outcome open_segment(const FileName& name, unsigned permissions) noexcept;
  void take_over() noexcept;
  [[nodiscard]] SegmentView segment() const noexcept { return {mapping_.data(), shape_}; }
  [[nodiscard]] ChunkSet leased_chunks() const noexcept;
  /// Chunk of the oldest message that is not among `excluded`, never that of the latest one.
  [[nodiscard]] std::uint32_t oldest_but(const ChunkSet& excluded) const noexcept;
  /// A chunk that nobody holds, claimed.
  std::uint32_t claim_one() noexcept;
  /// Claims every chunk but that of the latest message, or none of them.
  void claim_all(bool claimed) const noexcept;

  File lock_;
  File file_;
  Mapping mapping_;
  SegmentShape shape_;
  std::array<File, kMaxConsumers> slots_;
  FileName segment_name_;
  FileName lock_name_;
  std::array<FileName, kMaxConsumers> slot_names_;
  ChunkSet leased_ = {};  // when the writer looked last
  std::uint32_t loaned_ = kNone;
  std::size_t message_bytes_ = 0;
};

}  // namespace unimapper::shared_memory
