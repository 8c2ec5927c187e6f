// The two storages of the room's components
#pragma once

#include "src/merge/heap_memory.hpp"
#include "unimapper/core/owned.hpp"

namespace unimapper::test {

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
