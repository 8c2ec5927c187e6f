// Loops that are done in slices
#pragma once

#include <algorithm>
#include <cstdint>

#include "src/core/parts.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// Blocks of a part: a part takes some ten microseconds and more.
inline constexpr std::uint32_t kBlocksPerPart = 256;

/// Coarse voxels of a part.
inline constexpr std::uint32_t kVoxelsPerPart = 128;

/// Elements of a slice: all there are where nothing is deferred. Several workers share it: what a
/// call tells does not depend on them, only how long it takes.
[[nodiscard]] inline std::uint32_t slice_size(const PipelineConfig& config,
                                              std::uint32_t elements) noexcept {
  return config.deferred ? elements : UINT32_MAX;
}

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
