// A component of the core together with the memory it lives in.
#pragma once

#include <cstddef>
#include <memory>
#include <new>
#include <stdexcept>

#include "unimapper/core/arena.hpp"
#include "unimapper/core/expected.hpp"

namespace unimapper::merge {

/// Lays out a `Component` for `config` on the heap. Throws std::invalid_argument.
template <typename Component>
class InArena {
 public:
  template <typename Config>
  explicit InArena(const Config& config) {
    if (const Error error = config.validate(); error.code != ErrorCode::kOk) {
      throw std::invalid_argument(error.message);
    }
    Arena measuring = Arena::measuring();
    component_.attach(measuring, config);
    bytes_ = measuring.used();
    memory_.reset(
        static_cast<std::byte*>(::operator new (bytes_, std::align_val_t{Arena::kAlignment})));
    Arena arena(memory_.get(), bytes_);
    component_.attach(arena, config);
  }
  Component& operator*() { return component_; }
  Component* operator->() { return &component_; }
  /// Of the memory laid out.
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  struct Release {
    void operator()(std::byte* memory) const {
      ::operator delete (memory, std::align_val_t{Arena::kAlignment});
    }
  };
  Component component_;
  std::size_t bytes_ = 0;
  std::unique_ptr<std::byte, Release> memory_;
};

}  // namespace unimapper::merge
