// Vector of fixed capacity, laid out in an arena.
#pragma once

#include <cstddef>
#include <span>

#include "unimapper/core/arena.hpp"

namespace unimapper {

/// A contiguous sequence with a capacity set once. `push_back` on a full vector refuses and
/// counts; nothing is ever undefined. Elements must be trivially copyable. The vector itself
/// is a view: copies share the storage, so hold exactly one.
template <typename T>
class FixedVector {
 public:
  /// Takes room for `capacity` elements from `arena`.
  void allocate(Arena& arena, std::size_t capacity) noexcept {
    data_ = arena.allocate<T>(capacity);
    capacity_ = data_ == nullptr ? 0 : capacity;
    size_ = 0;
    refused_ = 0;
  }

  /// Appends, or refuses and counts when full. O(1).
  bool push_back(const T& value) noexcept {
    if (size_ == capacity_) {
      ++refused_;
      return false;
    }
    data_[size_++] = value;
    return true;
  }

  /// Sets the size; new elements keep whatever bytes the storage holds. False (and unchanged)
  /// if `size` exceeds the capacity.
  bool resize_uninitialized(std::size_t size) noexcept {
    if (size > capacity_) return false;
    size_ = size;
    return true;
  }

  /// Removes all elements; the count of refused ones stays.
  void clear() noexcept { size_ = 0; }
  /// Removes the last element, if there is one.
  void pop_back() noexcept {
    if (size_ > 0) --size_;
  }
  /// Zeroes the count of refused elements.
  void reset_refused() noexcept { refused_ = 0; }

  /// Elements in use.
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  /// Elements there is room for.
  [[nodiscard]] std::size_t capacity() const noexcept { return capacity_; }
  /// Elements that still fit.
  [[nodiscard]] std::size_t available() const noexcept { return capacity_ - size_; }
  /// Whether there is no element.
  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
  /// Whether every further element is refused.
  [[nodiscard]] bool full() const noexcept { return size_ == capacity_; }
  /// Elements that did not fit since the last `reset_refused()`.
  [[nodiscard]] std::size_t refused() const noexcept { return refused_; }

  T& operator[](std::size_t i) noexcept { return data_[i]; }
  const T& operator[](std::size_t i) const noexcept { return data_[i]; }
  /// The last element; there must be one.
  T& back() noexcept { return data_[size_ - 1]; }
  /// First element; all lie one after another.
  T* data() noexcept { return data_; }
  /// First element; all lie one after another.
  const T* data() const noexcept { return data_; }
  /// First element.
  T* begin() noexcept { return data_; }
  /// One past the last element.
  T* end() noexcept { return data_ + size_; }
  /// First element.
  const T* begin() const noexcept { return data_; }
  /// One past the last element.
  const T* end() const noexcept { return data_ + size_; }
  /// All elements.
  [[nodiscard]] std::span<const T> view() const noexcept { return {data_, size_}; }
  /// All elements.
  [[nodiscard]] std::span<T> view() noexcept { return {data_, size_}; }

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
  std::size_t capacity_ = 0;
  std::size_t refused_ = 0;
};

}  // namespace unimapper
