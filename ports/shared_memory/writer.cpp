#include "ports/shared_memory/writer.hpp"

#include <sys/mman.h>
#include <sys/random.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "ports/shared_memory/steps.hpp"

namespace unimapper::shared_memory {

namespace {

/// Threads in `Writer::wait_beyond`.
constexpr std::uint32_t kAnnouncers = 1;

struct Permissions {
  unsigned segment = 0600;
  unsigned slot = 0600;
};

Permissions permissions_for(Audience audience) noexcept {
  switch (audience) {
    case Audience::kSameGroup:
      return {0640, 0660};
    case Audience::kEveryone:
      return {0644, 0666};
    case Audience::kSameUser:
      break;
  }
  return {};
}

SegmentShape shape_of(const WriterOptions& options) noexcept {
  SegmentShape shape;
  shape.content = options.content;
  if (options.message_bytes > kMaxChunkBytes) return shape;
  shape.chunk_bytes = static_cast<std::uint32_t>((options.message_bytes + kPageBytes - 1) /
                                                 kPageBytes * kPageBytes);
  shape.consumers = options.consumers;
  shape.leases = options.leases;
  if (options.consumers > kMaxConsumers || options.leases > kMaxLeases ||
      options.history > kMaxChunks || options.history < 1) {
    return shape;
  }
  shape.chunks = options.consumers * options.leases + 1 + options.history;
  return shape;
}

/// Whether the mapped bytes are a segment of exactly this shape.
bool is_segment(const SegmentHeader& header, const SegmentShape& shape) noexcept {
  return header.magic.load(std::memory_order_acquire) == kSegmentMagic &&
         header.version == kSegmentVersion && header.byte_order == kByteOrder &&
         header.shape == shape;
}

bool contains(const std::array<std::uint32_t, kMaxChunks / 32>& set, std::uint32_t chunk) noexcept {
  return (set[chunk / 32] >> (chunk % 32) & 1U) != 0;
}

/// What a consumer's file holds; zeros where it is shorter.
LeaseTable read_leases(const File& file) noexcept {
  LeaseTable table = {};
  const ssize_t bytes = pread(file.descriptor(), &table, sizeof table, 0);
  if (bytes < static_cast<ssize_t>(sizeof table)) {
    const std::size_t known = bytes > 0 ? static_cast<std::size_t>(bytes) : 0;
    std::memset(reinterpret_cast<char*>(&table) + known, 0, sizeof table - known);
  }
  return table;
}

/// The chunk of a lease's word, or `shape.chunks` or more if it is none that counts.
std::uint32_t leased_chunk(std::uint32_t word, std::uint32_t revoked) noexcept {
  if (word >> 16U != (revoked & 0xFFFFU)) return kMaxChunks;
  return (word & 0xFFFFU) - 1U;  // 0 wraps
}

}  // namespace

Outcome Writer::open(std::string_view share, std::string_view topic,
                     const WriterOptions& options) noexcept {
  *this = Writer();
  Writer opened;
  opened.shape_ = shape_of(options);
  opened.message_bytes_ = options.message_bytes;
  if (options.message_bytes == 0 || !is_possible(opened.shape_)) {
    return {false, EINVAL,
            "a topic has 1 to 16 consumers with 1 to 8 leases each, messages of 1 to 2^28 bytes, "
            "and at most 256 chunks"};
  }
  if (!is_share_name(share) || !is_share_name(topic)) {
    return {false, EINVAL,
            "names of shares and topics have 1 to 40 letters, digits, '.', '_' or '-', no dot "
            "first"};
  }
  const Permissions permissions = permissions_for(options.audience);
  Outcome outcome = opened.lock(share, topic);
  if (!outcome.ok) return outcome;
  step(Step::kWriterLocked);
  outcome = opened.open_slots(share, topic, permissions.slot);
  if (!outcome.ok) return outcome;
  outcome = opened.open_segment(file_name(share, topic, FilePart::kSegment), permissions.segment);
  if (!outcome.ok) return outcome;
  step(Step::kSegmentOpened);
  opened.take_over();
  step(Step::kTakenOver);
  *this = std::move(opened);
  (void)reclaim();
  return {};
}

Outcome Writer::lock(std::string_view share, std::string_view topic) noexcept {
  lock_name_ = file_name(share, topic, FilePart::kWriterLock);
  constexpr int kTries = 8;
  for (int i = 0; i < kTries; ++i) {
    // Only this user's: who may open a file may lock it, and keep the next writer out.
    const Outcome made = make_file(lock_name_, 0600, lock_);
    if (!made.ok) return made;
    if (!lock_.lock()) {
      return {false, EBUSY, "another process publishes this topic: choose another name"};
    }
    // A lock on a file that was removed meanwhile keeps nobody out.
    if (lock_.has_name()) return {};
  }
  return {false, EBUSY, "another process removes this topic all the time"};
}

Outcome Writer::open_slots(std::string_view share, std::string_view topic,
                           unsigned permissions) noexcept {
  for (std::uint32_t i = 0; i < kMaxConsumers; ++i) {
    slot_names_[i] = file_name(share, topic, FilePart::kConsumer, i);
    if (i >= shape_.consumers) continue;
    Outcome made = make_file(slot_names_[i], permissions, slots_[i]);
    if (made.ok) made = reserve(slots_[i], kPageBytes);
    if (!made.ok) return made;
  }
  return {};
}

Outcome Writer::open_segment(const FileName& name, unsigned permissions) noexcept {
  segment_name_ = name;
  const std::uint64_t bytes = segment_bytes(shape_);
  Outcome outcome = make_file(name, permissions, file_);
  if (!outcome.ok) return outcome;
  if (file_.size() == static_cast<std::int64_t>(bytes)) {
    outcome = mapping_.open(file_, static_cast<std::size_t>(bytes), true);
    if (!outcome.ok) return outcome;
    if (is_segment(segment().header(), shape_)) {
      (void)file_.lock();
      return {};
    }
  }
  // A new file: whoever reads the old one keeps it as it is.
  (void)shm_unlink(name.text);
  outcome = make_file(name, permissions, file_);
  if (outcome.ok) outcome = reserve(file_, bytes);
  if (outcome.ok) outcome = mapping_.open(file_, static_cast<std::size_t>(bytes), true);
  if (!outcome.ok) {
    (void)shm_unlink(name.text);
    return outcome;
  }
  SegmentHeader& header = segment().header();
  header.version = kSegmentVersion;
  header.byte_order = kByteOrder;
  header.shape = shape_;
  header.magic.store(kSegmentMagic, std::memory_order_release);
  // Tells readers that there is a writer. Who can read the segment can lock it as well, so nothing
  // depends on it.
  (void)file_.lock();
  return {};
}

void Writer::take_over() noexcept {
  SegmentHeader& header = segment().header();
  std::array<std::uint32_t, 4> boot = {};
  (void)getrandom(boot.data(), sizeof boot, GRND_NONBLOCK);
  for (std::size_t i = 0; i < boot.size(); ++i) header.boot[i].store(boot[i]);
  header.writers.fetch_add(1);
  const std::uint32_t latest = header.latest.load();
  for (std::uint32_t i = 0; i < shape_.chunks; ++i) {
    ChunkHeader& chunk = segment().chunk(i);
    // Whole, but never announced.
    if (chunk.sequence.load() > latest) chunk.sequence.store(0);
    chunk.claim.store(0);
  }
}

Writer::ChunkSet Writer::leased_chunks() const noexcept {
  ChunkSet set = {};
  for (std::uint32_t slot = 0; slot < shape_.consumers; ++slot) {
    const LeaseTable table = read_leases(slots_[slot]);
    const std::uint32_t revoked = segment().header().revoked[slot].load();
    for (std::uint32_t i = 0; i < shape_.leases; ++i) {
      const std::uint32_t chunk = leased_chunk(table.lease[i], revoked);
      if (chunk < shape_.chunks) set[chunk / 32] |= 1U << chunk % 32;
    }
  }
  return set;
}

std::uint32_t Writer::oldest_but(const ChunkSet& excluded) const noexcept {
  const std::uint32_t latest = segment().header().latest.load(std::memory_order_relaxed);
  std::uint32_t found = kNone;
  std::uint32_t oldest = 0;
  for (std::uint32_t i = 0; i < shape_.chunks; ++i) {
    const std::uint32_t sequence = segment().chunk(i).sequence.load(std::memory_order_relaxed);
    // Late joiners want the latest message.
    if ((sequence == latest && latest != 0) || contains(excluded, i)) continue;
    if (found != kNone && sequence >= oldest) continue;
    oldest = sequence;
    found = i;
  }
  return found;
}

void Writer::claim_all(bool claimed) const noexcept {
  const std::uint32_t latest = segment().header().latest.load(std::memory_order_relaxed);
  for (std::uint32_t i = 0; i < shape_.chunks; ++i) {
    ChunkHeader& chunk = segment().chunk(i);
    if (latest != 0 && chunk.sequence.load(std::memory_order_relaxed) == latest) continue;
    chunk.claim.store(claimed ? 1 : 0, std::memory_order_release);
  }
}

std::uint32_t Writer::claim_one() noexcept {
  // A consumer writes its lease and then looks for a claim; the writer claims and then looks for
  // leases: one of them sees the other.
  const std::uint32_t likely = oldest_but(leased_);
  segment().chunk(likely).claim.store(1);
  std::atomic_thread_fence(std::memory_order_seq_cst);
  step(Step::kChunkClaimed);
  leased_ = leased_chunks();
  if (!contains(leased_, likely)) return likely;
  // It was leased since the last look, as any other may be before the next. With all of them
  // claimed one look is enough, whatever consumers write meanwhile: every table holds so few leases
  // that a chunk without one remains.
  claim_all(true);
  std::atomic_thread_fence(std::memory_order_seq_cst);
  leased_ = leased_chunks();
  const std::uint32_t chosen = oldest_but(leased_);
  for (std::uint32_t i = 0; i < shape_.chunks; ++i) {
    if (i != chosen) segment().chunk(i).claim.store(0, std::memory_order_release);
  }
  return chosen;
}

std::span<std::byte> Writer::loan() noexcept {
  if (!is_open() || latest() == ~0U) return {};
  if (loaned_ == kNone) {
    loaned_ = claim_one();
    segment().chunk(loaned_).sequence.store(0, std::memory_order_relaxed);
    // What is written into the chunk comes after this.
    std::atomic_thread_fence(std::memory_order_seq_cst);
    step(Step::kChunkLoaned);
  }
  return segment().chunk_memory(loaned_).first(message_bytes_);
}

std::uint32_t Writer::publish(std::size_t bytes, std::int64_t stamp_ns) noexcept {
  if (!is_open() || loaned_ == kNone || bytes > message_bytes_) return 0;
  SegmentHeader& header = segment().header();
  ChunkHeader& chunk = segment().chunk(loaned_);
  const std::uint32_t sequence = header.latest.load(std::memory_order_relaxed) + 1;
  const auto stamp = static_cast<std::uint64_t>(stamp_ns);
  chunk.bytes = static_cast<std::uint32_t>(bytes);
  chunk.writer = header.writers.load(std::memory_order_relaxed);
  chunk.stamp[0] = static_cast<std::uint32_t>(stamp);
  chunk.stamp[1] = static_cast<std::uint32_t>(stamp >> 32U);
  chunk.sequence.store(sequence, std::memory_order_release);
  step(Step::kSequenceWritten);
  chunk.claim.store(0, std::memory_order_release);
  step(Step::kClaimReleased);
  header.latest.store(sequence, std::memory_order_seq_cst);
  step(Step::kMessageAnnounced);
  loaned_ = kNone;
  // No more than there can be: who reads may also sleep here in many threads.
  wake(header.latest, shape_.consumers + kAnnouncers);
  return sequence;
}

std::uint32_t Writer::wait_beyond(std::uint32_t seen, std::int64_t timeout_ns) const noexcept {
  if (!is_open()) return 0;
  const Word& word = segment().header().latest;
  if (word.load(std::memory_order_acquire) == seen) wait_on(word, seen, timeout_ns);
  return latest();
}

std::uint32_t Writer::latest() const noexcept {
  return is_open() ? segment().header().latest.load(std::memory_order_acquire) : 0;
}

std::uint32_t Writer::reclaim() noexcept {
  std::uint32_t given_back = 0;
  for (std::uint32_t slot = 0; is_open() && slot < shape_.consumers; ++slot) {
    if (!slots_[slot].lock()) continue;
    const LeaseTable table = read_leases(slots_[slot]);
    for (const std::uint32_t word : table.lease) given_back += word != 0 ? 1 : 0;
    const LeaseTable empty = {};
    (void)!pwrite(slots_[slot].descriptor(), &empty, sizeof empty, 0);
    slots_[slot].unlock();
  }
  return given_back;
}

void Writer::revoke(std::uint32_t slot) noexcept {
  if (is_open() && slot < shape_.consumers) segment().header().revoked[slot].fetch_add(1);
}

ConsumerState Writer::consumer(std::uint32_t slot) const noexcept {
  ConsumerState state;
  if (!is_open() || slot >= shape_.consumers) return state;
  const LeaseTable table = read_leases(slots_[slot]);
  const std::uint32_t revoked = segment().header().revoked[slot].load();
  state.present = slots_[slot].is_locked();
  for (std::uint32_t i = 0; i < shape_.leases; ++i) {
    state.leases += leased_chunk(table.lease[i], revoked) < shape_.chunks ? 1 : 0;
  }
  state.process = table.process;
  state.taken = table.taken;
  state.missed = table.missed;
  return state;
}

void Writer::remove() noexcept {
  if (is_open()) {
    (void)shm_unlink(segment_name_.text);
    for (const FileName& name : slot_names_) (void)shm_unlink(name.text);
    (void)shm_unlink(lock_name_.text);
  }
  *this = Writer();
}

}  // namespace unimapper::shared_memory
