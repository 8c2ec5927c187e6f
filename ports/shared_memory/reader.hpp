// Reader of a topic: messages leased from a ring of chunks in shared memory, without copying.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "ports/shared_memory/segment.hpp"

namespace unimapper::shared_memory {

class Reader;

/// A message on lease: it stays as it is until the sample is gone. To be released before its
/// reader.
class Sample {
 public:
  Sample() = default;
  Sample(Sample&& other) noexcept { *this = std::move(other); }
  Sample& operator=(Sample&& other) noexcept;
  Sample(const Sample&) = delete;
  Sample& operator=(const Sample&) = delete;
  ~Sample() { release(); }

  /// Whether there is a message.
  [[nodiscard]] bool has_message() const noexcept { return reader_ != nullptr; }
  /// The message, in shared memory. Whoever does not trust the writer checks what it reads, and
  /// reads each number once.
  [[nodiscard]] std::span<const std::byte> bytes() const noexcept { return bytes_; }
  /// Number of the message on its topic, from 1, over all writers.
  [[nodiscard]] std::uint32_t sequence() const noexcept { return sequence_; }
  /// Time of the message by the writer, ns.
  [[nodiscard]] std::int64_t stamp_ns() const noexcept { return stamp_ns_; }
  /// Number of the writer: another one has started since where it differs.
  [[nodiscard]] std::uint32_t writer() const noexcept { return writer_; }
  /// Messages between the one taken before and this one that are gone.
  [[nodiscard]] std::uint32_t missed() const noexcept { return missed_; }
  /// True if the message has been whole up to now. False only after the writer revoked the leases
  /// of this consumer and used the chunk: what was read of the message is then worth nothing.
  [[nodiscard]] bool intact() const noexcept;
  /// Gives the message back; the sample has none afterwards.
  void release() noexcept;

 private:
  friend class Reader;
  Reader* reader_ = nullptr;
  std::span<const std::byte> bytes_;
  std::int64_t stamp_ns_ = 0;
  std::uint32_t sequence_ = 0;
  std::uint32_t writer_ = 0;
  std::uint32_t missed_ = 0;
  std::uint32_t chunk_ = 0;
  std::uint32_t lease_ = 0;
};

/// What came of taking a message.
enum class Taken : std::uint8_t {
  kMessage,     ///< there is one
  kNothing,     ///< none that was not taken before
  kLeasesUsed,  ///< this consumer holds as many as it may: release one
  kFailed       ///< the reader is not open, or its lease could not be written
};

/// Where to begin, and what is expected.
struct ReaderOptions {
  /// The first message: the latest one, as late joiners want it, or the oldest that is still there.
  enum class Start : std::uint8_t { kLatest, kOldest };
  Start start = Start::kLatest;  ///< which message comes first
  std::uint32_t content = 0;     ///< as `WriterOptions::content`
};

/// One consumer of a topic. Messages are taken in order; what the ring no longer holds is counted.
/// After `open`: no heap; each `take` and each release writes 64 bytes (one system call). Neither
/// waits for the writer longer than two milliseconds. Not thread safe; stays where it is.
class Reader {
 public:
  Reader() = default;
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  ~Reader() = default;

  /// Becomes a consumer of `topic` of `share`. Refused where nobody has published it yet
  /// (`error_number` ENOENT), where all slots are in use (EBUSY), and where it is of another
  /// version or content. For the start of a program, and after `is_replaced`.
  Outcome open(std::string_view share, std::string_view topic,
               const ReaderOptions& options = {}) noexcept;
  /// Whether it is a consumer.
  [[nodiscard]] bool is_open() const noexcept { return mapping_.data() != nullptr; }

  /// Takes the next message, in order. What `sample` held is released first.
  Taken take(Sample& sample) noexcept;
  /// Takes the newest message and passes over those before it, which are not counted as missed.
  Taken take_latest(Sample& sample) noexcept;
  /// Sleeps until there is a message to take; false if there is none after `timeout_ns`, or if
  /// there never will be one (`is_replaced`).
  [[nodiscard]] bool wait(std::int64_t timeout_ns) const noexcept;

  /// Whether a writer says that it lives.
  [[nodiscard]] bool has_writer() const noexcept { return file_.is_locked(); }
  /// Whether the topic was removed, or made anew with other sizes: open it again.
  [[nodiscard]] bool is_replaced() const noexcept { return !file_.has_name(); }
  /// Messages missed so far.
  [[nodiscard]] std::uint32_t missed() const noexcept { return table_.missed; }
  /// Sequence of the message published last; 0: none.
  [[nodiscard]] std::uint32_t latest() const noexcept;
  /// Number of its slot, from 0.
  [[nodiscard]] std::uint32_t slot() const noexcept { return slot_; }
  /// Sizes of the topic.
  [[nodiscard]] const SegmentShape& shape() const noexcept { return shape_; }

 private:
  friend class Sample;
  static constexpr std::uint32_t kNone = ~0U;
  enum class Lease : std::uint8_t { kHeld, kClaimed, kGone, kFailed };

  Outcome open_segment(std::string_view share, std::string_view topic,
                       std::uint32_t content) noexcept;
  Outcome join(std::string_view share, std::string_view topic) noexcept;
  [[nodiscard]] SegmentView segment() const noexcept { return {mapping_.data(), shape_}; }
  /// Chunk of the oldest message from `first` to `last`, and its sequence.
  [[nodiscard]] std::uint32_t find(std::uint32_t first, std::uint32_t last,
                                   std::uint32_t& sequence) const noexcept;
  Lease lease(std::uint32_t index, std::uint32_t chunk, std::uint32_t sequence) noexcept;
  Lease lease_patiently(std::uint32_t index, std::uint32_t chunk, std::uint32_t sequence) noexcept;
  [[nodiscard]] bool write_table() const noexcept;
  void give_back(std::uint32_t index) noexcept;

  File file_;
  Mapping mapping_;
  SegmentShape shape_;
  File table_file_;
  LeaseTable table_ = {};
  std::uint32_t slot_ = 0;
  std::uint32_t next_ = 1;
};

}  // namespace unimapper::shared_memory
