// Memory blocks from the heap, and components that own theirs.
//
// For objects that allocate at start-up and for tests; the onboard libraries themselves include it
// nowhere.
#pragma once

#include <cstddef>
#include <memory>
#include <new>
#include <span>
#include <utility>

#include "unimapper/core/arena.hpp"
#include "unimapper/core/assert.hpp"
#include "unimapper/core/expected.hpp"

namespace unimapper {

/// A block of memory from the heap, aligned for an `Arena`. Throws nothing: a block that the heap
/// does not have is empty. Moving keeps the memory where it is, so what lies in it stays valid.
class MemoryBlock {
 public:
  MemoryBlock() = default;
  /// `bytes` bytes, their first one on a multiple of `alignment`.
  explicit MemoryBlock(std::size_t bytes, std::size_t alignment = Arena::kAlignment) noexcept
      : memory_(static_cast<std::byte*>(
                    ::operator new (bytes, std::align_val_t{alignment}, std::nothrow)),
                Release{std::align_val_t{alignment}}),
        bytes_(memory_ == nullptr ? 0 : bytes) {}
  MemoryBlock(MemoryBlock&& other) noexcept
      : memory_(std::move(other.memory_)), bytes_(std::exchange(other.bytes_, 0)) {}
  MemoryBlock& operator=(MemoryBlock&& other) noexcept {
    memory_ = std::move(other.memory_);
    bytes_ = std::exchange(other.bytes_, 0);
    return *this;
  }
  MemoryBlock(const MemoryBlock&) = delete;
  MemoryBlock& operator=(const MemoryBlock&) = delete;
  ~MemoryBlock() = default;

  /// First byte; null if the block is empty.
  [[nodiscard]] std::byte* data() const noexcept { return memory_.get(); }
  /// Bytes of the block.
  [[nodiscard]] std::size_t size() const noexcept { return bytes_; }
  /// All of it.
  [[nodiscard]] std::span<std::byte> span() const noexcept { return {data(), bytes_}; }

 private:
  struct Release {
    std::align_val_t alignment;
    void operator()(std::byte* memory) const noexcept { ::operator delete(memory, alignment); }
  };
  std::unique_ptr<std::byte, Release> memory_;
  std::size_t bytes_ = 0;
};

/// A block exactly as large as what `allocate(arena)` lays out in it, with that laid out; empty if
/// the heap has no such block.
template <typename Block = MemoryBlock, typename Allocate>
[[nodiscard]] Block lay_out(const Allocate& allocate) {
  Arena measuring = Arena::measuring();
  allocate(measuring);
  Block block(measuring.used());
  Arena arena(block.data(), block.size());
  allocate(arena);
  UNIMAPPER_ASSERT(!arena.exhausted(), "a component allocates more than it did when measured");
  return block;
}

/// A component in a block of its own: `component.allocate(arena, config...)`. Allocates in the
/// constructor and nowhere else. Throws what `Block`'s constructor throws, by default nothing: look
/// at `ok()`, as using a component that was refused stops the program. Moved, not copied.
template <typename Component, typename Block = MemoryBlock>
class Owned {
 public:
  /// Refuses what the `validate()` of an argument refuses.
  template <typename... Config>
  explicit Owned(const Config&... config) {
    if (!(is_valid(config) && ...)) return;
    block_ = lay_out<Block>([&](Arena& arena) { component_.allocate(arena, config...); });
    if (block_.data() == nullptr) {
      error_ = {ErrorCode::kMemoryTooSmall, "the heap does not have the memory of a component"};
    }
  }
  /// What was laid out stays where it is.
  Owned(Owned&&) noexcept = default;
  Owned& operator=(Owned&&) noexcept = default;
  Owned(const Owned&) = delete;
  Owned& operator=(const Owned&) = delete;
  ~Owned() = default;

  /// Whether there is a component.
  [[nodiscard]] bool ok() const noexcept { return error_.ok(); }
  /// `kOk`, or why there is no component: an invalid configuration (`kInvalidConfig`), or the heap
  /// does not have the memory (`kMemoryTooSmall`).
  [[nodiscard]] const Error& error() const noexcept { return error_; }

  /// Only where `ok()`.
  Component& operator*() noexcept {
    UNIMAPPER_ASSERT(ok(), error_.message);
    return component_;
  }
  Component* operator->() noexcept { return &**this; }

  /// Size of the memory laid out.
  [[nodiscard]] std::size_t bytes() const noexcept { return block_.size(); }

 private:
  template <typename Config>
  bool is_valid(const Config& config) noexcept {
    if constexpr (requires { config.validate(); }) error_ = config.validate();
    return error_.ok();
  }

  Component component_;
  Block block_;
  Error error_;
};

}  // namespace unimapper
