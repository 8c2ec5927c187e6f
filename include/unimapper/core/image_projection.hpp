// Spherical projection of range images.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "unimapper/core/angles.hpp"

namespace unimapper {

/// How far images reach beyond the outermost rays, degrees: mounting and beam offsets. Nothing was
/// measured there, so points are not looked up in it.
inline constexpr float kImageSlackDeg = 1.0F;

/// Field of view and resolution of an image about the sensor's x axis, degrees.
struct RangeImageShape {
  float horizontal_fov_deg = 360.0F;      ///< full width about the x axis
  float azimuth_resolution_deg = 0.4F;    ///< width of a pixel
  float elevation_min_deg = -45.0F;       ///< lower edge
  float elevation_max_deg = 45.0F;        ///< upper edge
  float elevation_resolution_deg = 0.5F;  ///< height of a pixel

  friend bool operator==(const RangeImageShape&, const RangeImageShape&) = default;
};

/// Which pixel a direction falls into: columns are even in azimuth, rows in the sine of the
/// elevation, so that no arc functions are needed.
class ImageProjection {
 public:
  ImageProjection() = default;
  explicit ImageProjection(const RangeImageShape& shape) noexcept;

  static constexpr std::int32_t kOutside = -1;  ///< the pixel of a direction outside the image

  /// Where a point falls.
  struct Target {
    std::int32_t inside;  ///< mask: -1 within the field of view, else 0
    std::int32_t pixel;   ///< numbered row by row; 0 outside
    float range_m;        ///< from the sensor, metres
  };
  /// Of a point in the sensor frame, metres. Without branches, so that loops over it vectorise.
  [[nodiscard]] Target project(float x, float y, float z) const noexcept {
    return target(x, y, z, 0.0F, static_cast<float>(rows_));
  }
  /// As `project`, and outside beyond the outermost rays as well, where an image tells what lies
  /// at the edge of what was measured and not what lies there.
  [[nodiscard]] Target look_up(float x, float y, float z) const noexcept {
    return target(x, y, z, first_measured_row_, end_measured_row_);
  }

  /// Pixels and ranges of `count` points in the sensor frame, metres; `kOutside` where the
  /// direction is not within the field of view. Pixels are numbered row by row. Vectorises.
  void project(const float* x, const float* y, const float* z, std::size_t count,
               std::int32_t* pixel, float* range_m) const noexcept;

  /// Pixels in azimuth.
  [[nodiscard]] std::int32_t columns() const noexcept { return columns_; }
  /// Pixels in elevation.
  [[nodiscard]] std::int32_t rows() const noexcept { return rows_; }
  /// Sine of the elevation of a row's middle.
  [[nodiscard]] float sine(std::int32_t row) const noexcept {
    return first_sine_ + (static_cast<float>(row) + 0.5F) / rows_per_sine_;
  }
  /// Pixels of the image.
  [[nodiscard]] std::size_t pixels() const noexcept {
    return static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
  }
  /// The leftmost column is next to the rightmost one.
  [[nodiscard]] bool wraps() const noexcept { return wraps_; }

 private:
  /// Rows from `first_row` to below `end_row` are inside.
  [[nodiscard]] Target target(float x, float y, float z, float first_row,
                              float end_row) const noexcept {
    const auto columns = static_cast<float>(columns_);
    const float range = std::sqrt(x * x + y * y + z * z);
    const float sine = z / (range + 1.17549435e-38F);
    float row = (sine - first_sine_) * rows_per_sine_;
    float column = (direction_turns(x, y) - first_turn_) * columns_per_turn_;
    // Exactly half a turn lies on the seam.
    const float seam = wraps_ ? columns : 2.0F * columns;
    column = column >= seam ? column - columns : column;
    std::int32_t inside = column >= 0.0F ? -1 : 0;  // false for NaN
    inside &= column < columns ? -1 : 0;
    inside &= row >= first_row ? -1 : 0;
    inside &= row < end_row ? -1 : 0;
    row = inside != 0 ? row : 0.0F;
    column = inside != 0 ? column : 0.0F;
    const std::int32_t at =
        static_cast<std::int32_t>(row) * columns_ + static_cast<std::int32_t>(column);
    return {inside, at, range};
  }

  std::int32_t columns_ = 0;
  std::int32_t rows_ = 0;
  bool wraps_ = true;
  float columns_per_turn_ = 0.0F;
  float first_turn_ = 0.0F;
  float rows_per_sine_ = 0.0F;
  float first_sine_ = 0.0F;
  float first_measured_row_ = 0.0F;
  float end_measured_row_ = 0.0F;
};

/// Ranges in pixels are kept in 1/128 m.
inline constexpr float kRangeUnitsPerMetre = 128.0F;
/// A pixel with too few returns for evidence.
inline constexpr std::uint16_t kNoRange = 0;

}  // namespace unimapper
