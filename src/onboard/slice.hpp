// Loops that are done in slices
#pragma once

#include <algorithm>
#include <cstdint>

namespace unimapper::onboard {

/// The elements from `first` on, those from `end` on excluded.
struct Slice {
  std::uint32_t first;
  std::uint32_t end;
};

/// A loop over numbered elements, some at a time.
class SlicedLoop {
 public:
  void begin() noexcept { next_ = 0; }
  /// The next `most` elements of `size`, or as many as there are.
  Slice next(std::uint32_t size, std::uint32_t most) noexcept {
    const std::uint32_t first = next_;
    next_ = size - std::min(size, first) > most ? first + most : size;
    is_over_ = next_ == size;
    return {first, next_};
  }
  /// The last slice held the last element.
  [[nodiscard]] bool is_over() const noexcept { return is_over_; }

 private:
  std::uint32_t next_ = 0;
  bool is_over_ = true;
};

}  // namespace unimapper::onboard
