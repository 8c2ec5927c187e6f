// Bump allocator over one block of the caller's memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <new>
#include <type_traits>

namespace unimapper {

/// Hands out 64-byte aligned arrays from one block. Laying out a component twice, first on a
/// measuring arena and then on the real one, makes the required size exact by construction.
///
/// A measuring arena returns null pointers and only counts. A real arena returns null when the
/// block is exhausted; `exhausted()` then stays true. Memory is zeroed as it is handed out,
/// which also faults its pages in. Not thread safe. Cost: one memset per array, at start-up.
class Arena {
 public:
  static constexpr std::size_t kAlignment = 64;  ///< bytes; every array starts on a multiple of it

  /// An arena that owns nothing and counts what would be used.
  static Arena measuring() noexcept { return Arena{}; }

  /// `base` must be aligned to `kAlignment` and stay valid for as long as anything laid out
  /// in it.
  Arena(std::byte* base, std::size_t bytes) noexcept : base_(base), bytes_(bytes) {}

  /// An array of `count` zeroed elements, or null (measuring, or exhausted).
  template <typename T>
  T* allocate(std::size_t count) noexcept {
    // Not "trivially copyable": Eigen's fixed-size types are plain arrays with a copy constructor.
    static_assert(std::is_trivially_destructible_v<T>, "the arena never runs destructors");
    static_assert(alignof(T) <= kAlignment);
    const std::size_t bytes = (count * sizeof(T) + kAlignment - 1) / kAlignment * kAlignment;
    const std::size_t offset = used_;
    used_ += bytes;
    if (base_ == nullptr) return nullptr;
    if (used_ > bytes_) {
      exhausted_ = true;
      return nullptr;
    }
    std::memset(base_ + offset, 0, bytes);
    return reinterpret_cast<T*>(base_ + offset);
  }

  /// Lays out two sets of arrays in the same memory: each by a function without arguments that
  /// allocates from this arena. Only one set may be in use at a time, and it finds whatever the
  /// other one left there.
  template <typename First, typename Second>
  void share(const First& first, const Second& second) noexcept {
    const std::size_t begin = used_;
    first();
    const std::size_t end = used_;
    used_ = begin;
    second();
    if (used_ < end) used_ = end;
  }

  /// True for an arena without memory, which only counts bytes.
  [[nodiscard]] bool is_measuring() const noexcept { return base_ == nullptr; }
  /// True once a request did not fit.
  [[nodiscard]] bool exhausted() const noexcept { return exhausted_; }
  /// Bytes handed out, or that would have been handed out.
  [[nodiscard]] std::size_t used() const noexcept { return used_; }

 private:
  Arena() = default;

  std::byte* base_ = nullptr;
  std::size_t bytes_ = 0;
  std::size_t used_ = 0;
  bool exhausted_ = false;
};

/// Creates a `State` in `arena` and lets it allocate its parts there: `state.allocate(arena,
/// config...)`. Null where the arena is measuring or exhausted; what the parts need is counted all
/// the same.
template <typename State, typename... Config>
[[nodiscard]] State* create_in(Arena& arena, const Config&... config) noexcept {
  State* const memory = arena.allocate<State>(1);
  if (memory == nullptr) {
    State measured;
    measured.allocate(arena, config...);
    return nullptr;
  }
  State* const state = new (memory) State;
  state->allocate(arena, config...);
  return state;
}

}  // namespace unimapper
