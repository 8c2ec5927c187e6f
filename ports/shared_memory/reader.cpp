#include "ports/shared_memory/reader.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>

#include "ports/shared_memory/steps.hpp"

namespace unimapper::shared_memory {

namespace {

constexpr std::int64_t kSlice = 100'000'000;

std::int64_t monotonic_ns() noexcept {
  timespec now = {};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

void pause_for(long nanoseconds) noexcept {
  timespec time = {};
  time.tv_nsec = nanoseconds;
  (void)nanosleep(&time, nullptr);
}

/// A segment's first bytes as plain numbers.
struct HeaderCopy {
  std::uint32_t magic;
  std::uint16_t version;
  std::uint16_t byte_order;
  SegmentShape shape;
};
static_assert(sizeof(HeaderCopy) == offsetof(SegmentHeader, writers));

Outcome check(const HeaderCopy& header, std::int64_t bytes, std::uint32_t content) noexcept {
  if (header.magic == 0) return {false, EAGAIN, "the topic is being made: try again"};
  if (header.magic != kSegmentMagic || header.byte_order != kByteOrder) {
    return {false, EPROTO, "this file in /dev/shm is no topic"};
  }
  if (header.version != kSegmentVersion) {
    return {false, EPROTO, "writer and reader are of different versions: build both of one"};
  }
  if (!is_possible(header.shape) ||
      bytes != static_cast<std::int64_t>(segment_bytes(header.shape))) {
    return {false, EPROTO, "the topic's sizes do not add up: remove it from /dev/shm"};
  }
  if (header.shape.content != content) {
    return {false, EPROTO, "the topic's messages are of another kind or version"};
  }
  return {};
}

}  // namespace

Sample& Sample::operator=(Sample&& other) noexcept {
  if (this == &other) return *this;
  release();
  reader_ = std::exchange(other.reader_, nullptr);
  bytes_ = std::exchange(other.bytes_, {});
  stamp_ns_ = other.stamp_ns_;
  sequence_ = other.sequence_;
  writer_ = other.writer_;
  missed_ = other.missed_;
  chunk_ = other.chunk_;
  lease_ = other.lease_;
  return *this;
}

bool Sample::intact() const noexcept {
  if (reader_ == nullptr) return false;
  std::atomic_thread_fence(std::memory_order_seq_cst);
  return reader_->segment().chunk(chunk_).sequence.load() == sequence_;
}

void Sample::release() noexcept {
  if (reader_ == nullptr) return;
  reader_->give_back(lease_);
  reader_ = nullptr;
  bytes_ = {};
}

Outcome Reader::open(std::string_view share, std::string_view topic,
                     const ReaderOptions& options) noexcept {
  mapping_ = {};
  table_file_ = {};
  table_ = {};
  Outcome outcome = open_segment(share, topic, options.content);
  if (outcome.ok) outcome = join(share, topic);
  if (!outcome.ok) {
    Mapping closed;
    std::swap(closed, mapping_);
    return outcome;
  }
  const std::uint32_t newest = latest();
  next_ = std::max(newest, 1U);
  std::uint32_t oldest = 0;
  if (options.start == ReaderOptions::Start::kOldest && find(1, newest, oldest) != kNone) {
    next_ = oldest;
  }
  return {};
}

Outcome Reader::open_segment(std::string_view share, std::string_view topic,
                             std::uint32_t content) noexcept {
  file_ = open_file(file_name(share, topic, FilePart::kSegment), false);
  if (!file_.is_open()) {
    return {false, ENOENT, "nobody has published this topic on this computer"};
  }
  HeaderCopy header = {};
  (void)!pread(file_.descriptor(), &header, sizeof header, 0);
  const Outcome outcome = check(header, file_.size(), content);
  if (!outcome.ok) return outcome;
  shape_ = header.shape;
  return mapping_.open(file_, static_cast<std::size_t>(segment_bytes(shape_)), false);
}

Outcome Reader::join(std::string_view share, std::string_view topic) noexcept {
  // A writer that looks for dead consumers holds a free slot's lock for a moment.
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    if (round > 0) pause_for(1'000'000);
    for (std::uint32_t i = 0; i < shape_.consumers; ++i) {
      File file = open_file(file_name(share, topic, FilePart::kConsumer, i), true);
      if (!file.is_open() && errno == EACCES) {
        return {false, EACCES, "this topic is for other users (see Audience)"};
      }
      if (!file.is_open() || !file.lock() || !file.has_name()) continue;
      step(Step::kConsumerLocked);
      table_file_ = std::move(file);
      slot_ = i;
      table_.process = static_cast<std::uint32_t>(getpid());
      if (!write_table()) return {false, errno, "the lease table cannot be written"};
      step(Step::kConsumerJoined);
      return {};
    }
  }
  return {false, EBUSY, "every slot for a consumer is in use: give the writer more"};
}

std::uint32_t Reader::latest() const noexcept {
  return is_open() ? segment().header().latest.load(std::memory_order_acquire) : 0;
}

std::uint32_t Reader::find(std::uint32_t first, std::uint32_t last,
                           std::uint32_t& sequence) const noexcept {
  std::uint32_t found = kNone;
  for (std::uint32_t i = 0; i < shape_.chunks; ++i) {
    const std::uint32_t here = segment().chunk(i).sequence.load(std::memory_order_acquire);
    if (here == 0 || here < first || here > last || (found != kNone && here > sequence)) continue;
    sequence = here;
    found = i;
  }
  return found;
}

bool Reader::write_table() const noexcept {
  return pwrite(table_file_.descriptor(), &table_, sizeof table_, 0) ==
         static_cast<ssize_t>(sizeof table_);
}

void Reader::give_back(std::uint32_t index) noexcept {
  // What was read of the message was read before.
  std::atomic_thread_fence(std::memory_order_seq_cst);
  table_.lease[index] = 0;
  (void)write_table();
  step(Step::kMessageReleased);
}

Reader::Lease Reader::lease(std::uint32_t index, std::uint32_t chunk,
                            std::uint32_t sequence) noexcept {
  const Word& revoked = segment().header().revoked[slot_];
  const std::uint32_t times = revoked.load();
  table_.lease[index] = lease_word(times, chunk);
  if (!write_table()) {
    table_.lease[index] = 0;
    return Lease::kFailed;
  }
  std::atomic_thread_fence(std::memory_order_seq_cst);
  step(Step::kLeaseWritten);
  const ChunkHeader& header = segment().chunk(chunk);
  // In this order: a claim that is over was followed by another sequence.
  const bool claimed = header.claim.load() != 0 || revoked.load() != times;
  const bool same = header.sequence.load() == sequence;
  if (same && !claimed) return Lease::kHeld;
  give_back(index);
  return same ? Lease::kClaimed : Lease::kGone;
}

Reader::Lease Reader::lease_patiently(std::uint32_t index, std::uint32_t chunk,
                                      std::uint32_t sequence) noexcept {
  // The writer claims a chunk it does not use for microseconds, unless it dies meanwhile.
  constexpr int kTries = 12;
  for (int i = 0; i < kTries; ++i) {
    const Lease result = lease(index, chunk, sequence);
    if (result != Lease::kClaimed) return result;
    pause_for(i < 2 ? 1'000 : 100'000);
  }
  return Lease::kGone;
}

Taken Reader::take(Sample& sample) noexcept {
  sample.release();
  if (!is_open()) return Taken::kFailed;
  const auto free = std::find(table_.lease, table_.lease + shape_.leases, 0U);
  if (free == table_.lease + shape_.leases) return Taken::kLeasesUsed;
  const auto index = static_cast<std::uint32_t>(free - table_.lease);
  const std::uint32_t first = next_;
  // The writer may overtake a consumer again and again, but not for ever.
  for (std::uint32_t i = 0; i < 2 * kMaxChunks; ++i) {
    const std::uint32_t last = latest();
    if (last < next_) return Taken::kNothing;
    std::uint32_t sequence = 0;
    const std::uint32_t chunk = find(next_, last, sequence);
    if (chunk == kNone) {
      // Overtaken meanwhile; or a writer that announces what it never wrote.
      if (latest() == last) next_ = last + 1;
      continue;
    }
    step(Step::kMessageFound);
    const Lease result = lease_patiently(index, chunk, sequence);
    if (result == Lease::kFailed) return Taken::kFailed;
    next_ = sequence + 1;
    if (result == Lease::kGone) continue;
    const ChunkHeader& header = segment().chunk(chunk);
    const std::uint32_t bytes = header.bytes;
    sample.reader_ = this;
    sample.bytes_ = segment().chunk_memory(chunk).first(std::min(bytes, shape_.chunk_bytes));
    sample.stamp_ns_ = static_cast<std::int64_t>(std::uint64_t{header.stamp[1]} << 32U |
                                                 std::uint64_t{header.stamp[0]});
    sample.sequence_ = sequence;
    sample.writer_ = header.writer;
    sample.missed_ = sequence - first;
    sample.chunk_ = chunk;
    sample.lease_ = index;
    table_.missed += sample.missed_;
    table_.taken = sequence;
    step(Step::kLeaseChecked);
    return Taken::kMessage;
  }
  return Taken::kNothing;
}

Taken Reader::take_latest(Sample& sample) noexcept {
  next_ = std::max(next_, latest());
  return take(sample);
}

bool Reader::wait(std::int64_t timeout_ns) const noexcept {
  if (!is_open()) return false;
  const Word& word = segment().header().latest;
  const std::int64_t end = monotonic_ns() + timeout_ns;
  for (;;) {
    const std::uint32_t seen = word.load();
    if (seen >= next_) return true;
    const std::int64_t left = end - monotonic_ns();
    if (left <= 0 || is_replaced()) return false;
    // In slices: nobody wakes the readers of a topic that is replaced.
    wait_on(word, seen, std::min(left, kSlice));
  }
}

}  // namespace unimapper::shared_memory
