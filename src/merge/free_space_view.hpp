// What a keyframe saw as free: everything in front of the nearest surface of each direction.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "unimapper/core/keyframe_record.hpp"

namespace unimapper::merge {

enum class Visibility : std::uint8_t {
  kUnknown,   ///< out of view, or behind something
  kOccupied,  ///< at a surface
  kFree,      ///< clearly in front of one
};

/// Nearest range per direction, 1.5 degrees a pixel, from all cells of a keyframe, removed ones
/// too: what moved hid what was behind it. 38 kB each.
class FreeSpaceView {
 public:
  explicit FreeSpaceView(const KeyframeRecord& keyframe);

  /// Judges a point in the levelled keyframe frame. Cautious: the nearest surface among the 3x3
  /// pixels around counts, and most of these must have seen something.
  [[nodiscard]] Visibility look(const Eigen::Vector3f& point, float margin_m) const;

  /// Share of all directions within 60 degrees of the horizon that hold a return.
  [[nodiscard]] double field_of_view() const;

 private:
  static constexpr int kColumns = 240;
  static constexpr int kRows = 80;  // from -60 to +60 degrees

  /// Pixel of a direction; row -1 above or below the picture.
  static void pixel(const Eigen::Vector3f& point, int& column, int& row);
  [[nodiscard]] static std::size_t index_of(int row, int column) {
    return static_cast<std::size_t>(row) * kColumns + static_cast<std::size_t>(column);
  }

  std::vector<std::uint16_t> range_cm_;  // 0: nothing seen
};

}  // namespace unimapper::merge
