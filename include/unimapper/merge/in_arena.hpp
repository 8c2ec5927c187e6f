// Heap memory for components that are laid out in an arena.
#pragma once

#include <cstddef>
#include <memory>
#include <stdexcept>

#include "unimapper/core/arena.hpp"
#include "unimapper/core/expected.hpp"

namespace unimapper::merge {

/// Frees memory of `allocate_pages`.
struct ReleasePages {
  void operator()(std::byte* memory) const noexcept;
};
using Pages = std::unique_ptr<std::byte, ReleasePages>;

/// Memory aligned for an `Arena`. Large blocks lie in large pages where the system has them:
/// otherwise random access to gigabytes takes as long for address translation as for the memory
/// itself. Throws std::bad_alloc.
[[nodiscard]] Pages allocate_pages(std::size_t bytes);

/// Lays out a `Component` on the heap: `component.allocate(arena, config, more...)`. Throws
/// std::invalid_argument for a wrong configuration.
template <typename Component>
class InArena {
 public:
  template <typename Config, typename... More>
  explicit InArena(const Config& config, const More&... more) {
    if (const Error error = config.validate(); error.code != ErrorCode::kOk) {
      throw std::invalid_argument(error.message);
    }
    Arena measuring = Arena::measuring();
    component_.allocate(measuring, config, more...);
    bytes_ = measuring.used();
    memory_ = allocate_pages(bytes_);
    Arena arena(memory_.get(), bytes_);
    component_.allocate(arena, config, more...);
  }
  Component& operator*() { return component_; }
  Component* operator->() { return &component_; }
  /// Size of the memory laid out.
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  Component component_;
  std::size_t bytes_ = 0;
  Pages memory_;
};

}  // namespace unimapper::merge
