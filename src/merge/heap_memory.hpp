// Heap storage for components that lay out arrays
#pragma once

#include <cstddef>
#include <memory>
#include <type_traits>
#include <vector>

namespace unimapper::merge {

/// Hands out zeroed arrays as `Arena` does, each on the heap, and owns them. Throws std::bad_alloc.
class HeapMemory {
 public:
  template <typename T>
  T* allocate(std::size_t count) {
    static_assert(std::is_trivially_destructible_v<T>, "destructors are not run");
    static_assert(alignof(T) <= __STDCPP_DEFAULT_NEW_ALIGNMENT__);
    arrays_.push_back(std::make_unique<std::byte[]>(count * sizeof(T)));
    return reinterpret_cast<T*>(arrays_.back().get());
  }

 private:
  std::vector<std::unique_ptr<std::byte[]>> arrays_;
};

}  // namespace unimapper::merge
