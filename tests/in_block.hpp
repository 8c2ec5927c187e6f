// Component in a block of memory of its own, as on the robot.
#pragma once

#include <cstddef>
#include <vector>

#include "unimapper/core/arena.hpp"

namespace unimapper::test {

/// A block exactly as large as what `allocate(arena)` lays out in it.
class ArenaBlock {
 public:
  template <typename Allocate>
  explicit ArenaBlock(const Allocate& allocate) {
    Arena measuring = Arena::measuring();
    allocate(measuring);
    chunks_.resize(measuring.used() / sizeof(Chunk));
    Arena arena(reinterpret_cast<std::byte*>(chunks_.data()), measuring.used());
    allocate(arena);
    fits_ = !arena.exhausted();
  }
  // Moving keeps the memory where it is, so what lies in it stays valid.
  ArenaBlock(ArenaBlock&&) noexcept = default;
  ArenaBlock& operator=(ArenaBlock&&) noexcept = default;
  ArenaBlock(const ArenaBlock&) = delete;
  ArenaBlock& operator=(const ArenaBlock&) = delete;
  ~ArenaBlock() = default;

  [[nodiscard]] bool fits() const { return fits_; }

 private:
  struct alignas(Arena::kAlignment) Chunk {
    std::byte bytes[Arena::kAlignment];
  };
  std::vector<Chunk> chunks_;
  bool fits_ = false;
};

/// Lays `Component` out in a block of its own: `component.allocate(arena, arguments...)`.
template <typename Component>
class InBlock {
 public:
  template <typename... Arguments>
  explicit InBlock(const Arguments&... arguments)
      : block_([&](Arena& arena) { component_.allocate(arena, arguments...); }) {}

  Component& operator*() { return component_; }
  Component* operator->() { return &component_; }
  [[nodiscard]] bool fits() const { return block_.fits(); }

 private:
  Component component_;
  ArenaBlock block_;
};

}  // namespace unimapper::test
