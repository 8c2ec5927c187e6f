// Memory pages that a pipeline touches, as the kernel counts them.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

namespace unimapper::bench {

/// A block of memory that is a mapping of its own, between two pages that nobody may touch: only
/// then does the kernel list it by itself. Throws std::bad_alloc.
class OwnMapping {
 public:
  explicit OwnMapping(std::size_t bytes);
  ~OwnMapping();
  OwnMapping(const OwnMapping&) = delete;
  OwnMapping& operator=(const OwnMapping&) = delete;

  /// On a page's boundary.
  [[nodiscard]] std::span<std::byte> span() const { return {block_, bytes_}; }

  /// From here on, `touched_bytes` counts.
  void start_counting();
  /// Bytes of the block's pages that were read or written since, at least; nothing where the kernel
  /// does not tell (it needs /proc/self/clear_refs and smaps), or was not asked.
  [[nodiscard]] std::optional<std::size_t> touched_bytes() const;

 private:
  std::size_t bytes_;
  std::size_t mapped_;
  std::byte* mapping_;
  std::byte* block_;
  bool counting_ = false;
};

}  // namespace unimapper::bench
