// Files of a topic: names, mapping and kernel locks.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <utility>

#include "ports/shared_memory/layout.hpp"
#include "ports/shared_memory/outcome.hpp"

namespace unimapper::shared_memory {

/// Name of a file in shared memory.
struct FileName {
  char text[128] = {};  ///< with a zero behind it; empty: the names given were none
};

/// Which of a topic's files.
enum class FilePart : std::uint8_t {
  kSegment,     ///< header and chunks
  kWriterLock,  ///< held by the writer
  kConsumer     ///< lease table of a consumer
};

/// Whether `name` may be part of a file's name: 1 to 40 letters, digits, '_' or '-'; and '.', but
/// not first.
[[nodiscard]] bool is_share_name(std::string_view name) noexcept;

/// "/unimapper.SHARE.TOPIC", and with ".writer" or ".NUMBER" behind it; empty unless both are
/// share names.
[[nodiscard]] FileName file_name(std::string_view share, std::string_view topic, FilePart part,
                                 std::uint32_t number = 0) noexcept;

/// An open file, closed at the end. Not inherited by programs that the process starts.
class File {
 public:
  File() = default;
  explicit File(int descriptor) noexcept : descriptor_(descriptor) {}
  File(File&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  File& operator=(File&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    return *this;
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  ~File();

  /// Whether there is one.
  [[nodiscard]] bool is_open() const noexcept { return descriptor_ >= 0; }
  /// For system calls; -1: none.
  [[nodiscard]] int descriptor() const noexcept { return descriptor_; }
  /// Whether the file still has its name; one without is used by those who have it open, and by
  /// nobody else.
  [[nodiscard]] bool has_name() const noexcept;
  /// Size, or -1.
  [[nodiscard]] std::int64_t size() const noexcept;

  /// Takes the kernel's exclusive lock on the file's first byte, unless another open file has it.
  /// Whatever ends the process releases it.
  [[nodiscard]] bool lock() const noexcept;
  /// Releases it.
  void unlock() const noexcept;
  /// Whether another open file has that lock.
  [[nodiscard]] bool is_locked() const noexcept;

 private:
  int descriptor_ = -1;
};

/// Opens a file that exists, for reading or for both. Not open if it cannot be.
[[nodiscard]] File open_file(const FileName& name, bool writable) noexcept;

/// Opens a file of this user's or makes it, with these permissions, whatever the umask.
Outcome make_file(const FileName& name, unsigned permissions, File& file) noexcept;

/// Gives the file its size and the memory for it, so that writing there never fails.
Outcome reserve(const File& file, std::uint64_t bytes) noexcept;

/// A file in the address space, shared with all that map it.
class Mapping {
 public:
  Mapping() = default;
  Mapping(Mapping&& other) noexcept { swap(other); }
  Mapping& operator=(Mapping&& other) noexcept {
    swap(other);
    return *this;
  }
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;
  ~Mapping();

  /// Maps the first `bytes` of the file; all pages are there when it returns.
  Outcome open(const File& file, std::size_t bytes, bool writable) noexcept;

  /// First byte; null: nothing is mapped.
  [[nodiscard]] std::byte* data() const noexcept { return data_; }
  /// Bytes mapped.
  [[nodiscard]] std::size_t size() const noexcept { return bytes_; }

 private:
  void swap(Mapping& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(bytes_, other.bytes_);
  }
  std::byte* data_ = nullptr;
  std::size_t bytes_ = 0;
};

/// The parts of a mapped segment. `shape` is the caller's copy, checked: a reader that asked the
/// header again could be told something else.
struct SegmentView {
  std::byte* data = nullptr;  ///< first byte of the segment
  SegmentShape shape;         ///< of the segment

  /// The header.
  [[nodiscard]] SegmentHeader& header() const noexcept {
    return *reinterpret_cast<SegmentHeader*>(data);
  }
  /// State of chunk `index`, below `shape.chunks`.
  [[nodiscard]] ChunkHeader& chunk(std::uint32_t index) const noexcept {
    return reinterpret_cast<ChunkHeader*>(data + kChunkHeadersOffset)[index];
  }
  /// Bytes of chunk `index`, below `shape.chunks`.
  [[nodiscard]] std::span<std::byte> chunk_memory(std::uint32_t index) const noexcept {
    return {data + chunks_offset(shape) + std::size_t{index} * shape.chunk_bytes,
            shape.chunk_bytes};
  }
};

/// Sleeps while `word` holds `value`, at most `timeout_ns`.
void wait_on(const Word& word, std::uint32_t value, std::int64_t timeout_ns) noexcept;
/// Wakes at most `count` that sleep on `word`.
void wake(const Word& word, std::uint32_t count) noexcept;

}  // namespace unimapper::shared_memory
