// Layout of a topic's segment in shared memory; docs/shared-memory.md has it to the byte.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

namespace unimapper::shared_memory {

/// A word that processes share. Only 32-bit words are: every supported processor reads and writes
/// them in one piece, from memory that is mapped for reading, too.
using Word = std::atomic<std::uint32_t>;
static_assert(Word::is_always_lock_free && sizeof(Word) == 4);

inline constexpr std::uint32_t kSegmentMagic = 0x4D534D55;  ///< "UMSM" in a little-endian file
inline constexpr std::uint16_t kSegmentVersion = 1;
inline constexpr std::uint16_t kByteOrder = 0x0102;  ///< as the writer's processor stores it

inline constexpr std::uint32_t kMaxConsumers = 16;  ///< consumers of a topic
inline constexpr std::uint32_t kMaxLeases = 8;      ///< leases of a consumer
inline constexpr std::uint32_t kMaxChunks = 256;    ///< chunks of a segment
/// Most bytes of a message: a segment fits into the address space of a 32-bit computer.
inline constexpr std::uint32_t kMaxChunkBytes = 1U << 28U;

/// What a segment is made of, written once by the writer that created it.
struct SegmentShape {
  std::uint32_t content = 0;      ///< what the messages are, a number of the caller's
  std::uint32_t chunk_bytes = 0;  ///< room for a message; a multiple of 4,096
  std::uint32_t chunks = 0;       ///< at least consumers x leases + 2
  std::uint32_t consumers = 0;    ///< slots for consumers
  std::uint32_t leases = 0;       ///< that one consumer may hold
  friend bool operator==(const SegmentShape&, const SegmentShape&) = default;
};

/// First bytes of a segment.
struct SegmentHeader {
  Word magic;                ///< `kSegmentMagic`; written last, 0 before
  std::uint16_t version;     ///< `kSegmentVersion`
  std::uint16_t byte_order;  ///< `kByteOrder`
  SegmentShape shape;        ///< sizes and counts
  Word writers;              ///< writers so far; the present one's number
  Word boot[4];              ///< random number of the present writer, 128 bits
  /// Sequence of the message published last, 0: none yet. Waiting consumers sleep on this word.
  Word latest;
  Word revoked[kMaxConsumers];  ///< per slot: how often its leases were revoked
};
static_assert(sizeof(SegmentHeader) == 116 && offsetof(SegmentHeader, latest) == 48);

/// State of a chunk. Those of all chunks follow the header.
struct ChunkHeader {
  Word sequence;            ///< of the message in it, from 1; 0: none, or one being written
  Word claim;               ///< 1 while the writer wants or fills the chunk
  std::uint32_t bytes;      ///< of the message
  std::uint32_t writer;     ///< number of the writer that published it, see `SegmentHeader`
  std::uint32_t stamp[2];   ///< time of the message in ns, lower half first
  std::uint32_t unused[2];  ///< 0
};
static_assert(sizeof(ChunkHeader) == 32);

inline constexpr std::size_t kChunkHeadersOffset = 128;
inline constexpr std::size_t kPageBytes = 4096;

/// Offset of the first chunk; each of them starts on a page.
[[nodiscard]] constexpr std::size_t chunks_offset(const SegmentShape& shape) noexcept {
  const std::size_t end = kChunkHeadersOffset + shape.chunks * sizeof(ChunkHeader);
  return (end + kPageBytes - 1) / kPageBytes * kPageBytes;
}

/// Bytes of a segment.
[[nodiscard]] constexpr std::uint64_t segment_bytes(const SegmentShape& shape) noexcept {
  return chunks_offset(shape) + std::uint64_t{shape.chunks} * shape.chunk_bytes;
}

/// Whether a segment may have this shape: the writer never runs out of chunks, and every offset
/// fits.
[[nodiscard]] constexpr bool is_possible(const SegmentShape& shape) noexcept {
  if (shape.consumers < 1 || shape.consumers > kMaxConsumers) return false;
  if (shape.leases < 1 || shape.leases > kMaxLeases) return false;
  if (shape.chunks < shape.consumers * shape.leases + 2 || shape.chunks > kMaxChunks) return false;
  if (shape.chunk_bytes == 0 || shape.chunk_bytes > kMaxChunkBytes) return false;
  if (shape.chunk_bytes % kPageBytes != 0) return false;
  return segment_bytes(shape) <= PTRDIFF_MAX;
}

/// A consumer's file: the one thing in shared memory that a consumer writes. The kernel's lock on
/// its first byte says that the slot has an owner. Read and written by system calls, never mapped:
/// who may write a file may also shorten it, and that would end a process that has it mapped.
struct LeaseTable {
  /// Each 0 or 65536 x (`revoked` of the slot, modulo 65536) + number of a chunk, from 1.
  std::uint32_t lease[kMaxLeases];
  std::uint32_t process;    ///< the consumer's process id, for display only
  std::uint32_t taken;      ///< sequence of the message taken last, for display only
  std::uint32_t missed;     ///< messages it never saw, for display only
  std::uint32_t unused[5];  ///< 0
};
static_assert(sizeof(LeaseTable) == 64);

/// Word of a lease.
[[nodiscard]] constexpr std::uint32_t lease_word(std::uint32_t revoked,
                                                 std::uint32_t chunk) noexcept {
  return revoked << 16U | (chunk + 1U);
}

}  // namespace unimapper::shared_memory
