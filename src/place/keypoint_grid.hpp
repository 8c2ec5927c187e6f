// Uniform grid of keypoints for nearest-neighbour search.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

#include "src/core/voxel_key.hpp"

namespace unimapper::place {

/// At most 255 keypoints on a grid of 2 m over +-64 m; what lies outside shares the outermost
/// cells.
class KeypointGrid {
 public:
  static constexpr std::uint32_t kMaxPoints = 255;

  struct Point {
    float x;
    float y;
    float z;
    std::uint64_t code;
  };

  void clear() noexcept {
    count_ = 0;
    std::fill_n(first_, kWidth * kWidth, std::uint8_t{0});
  }

  /// False if full. O(1).
  bool add(const Point& point) noexcept {
    if (count_ == kMaxPoints) return false;
    points_[count_] = point;
    std::uint8_t& first = first_[cell(point.y) * kWidth + cell(point.x)];
    next_[count_] = first;
    first = static_cast<std::uint8_t>(++count_);
    return true;
  }

  [[nodiscard]] std::uint32_t size() const noexcept { return count_; }
  [[nodiscard]] const Point& operator[](std::uint32_t i) const noexcept { return points_[i]; }

  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  /// Index of the point nearest to (x, y) within `radius`, or `kNone`; lowers `distance_squared` to
  /// its distance. O(cells within the radius).
  [[nodiscard]] std::uint32_t nearest(float x, float y, float radius,
                                      float& distance_squared) const noexcept {
    distance_squared = radius * radius;
    std::uint32_t best = kNone;
    for (std::int32_t row = cell(y - radius); row <= cell(y + radius); ++row) {
      for (std::int32_t column = cell(x - radius); column <= cell(x + radius); ++column) {
        for (std::uint32_t i = first_[row * kWidth + column]; i != 0; i = next_[i - 1]) {
          const float dx = points_[i - 1].x - x;
          const float dy = points_[i - 1].y - y;
          const float distance = dx * dx + dy * dy;
          if (!(distance < distance_squared)) continue;
          distance_squared = distance;
          best = i - 1;
        }
      }
    }
    return best;
  }

 private:
  static constexpr std::int32_t kWidth = 64;
  static std::int32_t cell(float coordinate) noexcept {
    return std::clamp(floor_to_int(coordinate * 0.5F) + kWidth / 2, 0, kWidth - 1);
  }

  std::uint32_t count_ = 0;
  Point points_[kMaxPoints];
  std::uint8_t next_[kMaxPoints];
  std::uint8_t first_[kWidth * kWidth] = {};
};

}  // namespace unimapper::place
