// Components of the onboard libraries in large pages.
#pragma once

#include <cstddef>
#include <stdexcept>

#include "unimapper/core/owned.hpp"

namespace unimapper::merge {

/// A block that lies in large pages where it is large and the system has them: otherwise random
/// access to gigabytes takes as long for address translation as for the memory itself.
class LargePageBlock : public MemoryBlock {
 public:
  LargePageBlock() = default;
  /// Throws std::bad_alloc.
  explicit LargePageBlock(std::size_t bytes);
};

/// A component in large pages. Throws std::invalid_argument for a wrong configuration and
/// std::bad_alloc.
template <typename Component>
class InArena : public Owned<Component, LargePageBlock> {
 public:
  template <typename... Config>
  explicit InArena(const Config&... config) : Owned<Component, LargePageBlock>(config...) {
    if (!this->ok()) throw std::invalid_argument(this->error().message);
  }
};

}  // namespace unimapper::merge
