// The two storages of the room's components
#pragma once

#include <vector>

#include "src/merge/heap_memory.hpp"
#include "unimapper/core/arena.hpp"

namespace unimapper::test {

/// The caller's block, as on the robot.
template <typename Component>
class InBlock {
 public:
  template <typename... Arguments>
  explicit InBlock(const Arguments&... arguments) {
    Arena measuring = Arena::measuring();
    component_.allocate(measuring, arguments...);
    block_.resize(measuring.used() / sizeof(Chunk));
    Arena arena(block_.front().bytes, measuring.used());
    component_.allocate(arena, arguments...);
  }
  Component& operator*() { return component_; }
  Component* operator->() { return &component_; }

 private:
  struct alignas(Arena::kAlignment) Chunk {
    std::byte bytes[Arena::kAlignment];
  };
  Component component_;
  std::vector<Chunk> block_;
};

/// The heap, as at the base.
template <typename Component>
class OnHeap {
 public:
  template <typename... Arguments>
  explicit OnHeap(const Arguments&... arguments) {
    component_.allocate(memory_, arguments...);
  }
  Component& operator*() { return component_; }
  Component* operator->() { return &component_; }

 private:
  merge::HeapMemory memory_;
  Component component_;
};

}  // namespace unimapper::test
