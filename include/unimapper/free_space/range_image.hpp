// Range images: painting and minimum filter
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "unimapper/core/image_projection.hpp"
#include "unimapper/core/point_view.hpp"

namespace unimapper {

/// How points become an image.
struct RangePainterConfig {
  RangeImageShape shape;     ///< field of view and resolution
  float range_min_m = 0.0F;  ///< nearer points are not painted
  float range_max_m = 0.0F;  ///< farther points are not painted; at most 511
  /// Returns among a pixel and its eight neighbours below which the pixel stays unknown, [1, 9].
  std::uint32_t min_returns = 3;
  std::size_t max_points = 0;  ///< the rest of a scan is left out
  std::size_t max_pixels = 0;  ///< room for other shapes; at least the shape's own pixels
};

/// Paints scans into range images. A pixel holds the *smallest* range measured in it and around it,
/// so that what lies nearer than the pixel was certainly seen through, whatever falls between the
/// rays. Without enough returns it is `kNoRange`: a ray without an echo may have hit glass, sky
/// or a black car.
class RangePainter {
 public:
  /// `memory.allocate<T>(count)` gives arrays that live as long as the painter: an `Arena` on the
  /// robot, the heap at the base.
  template <typename Memory>
  void allocate(Memory& memory, const RangePainterConfig& config) {
    config_ = config;
    projection_ = ImageProjection(config.shape);
    const std::size_t room = std::max(projection_.pixels(), config.max_pixels);
    nearest_ = memory.template allocate<std::uint16_t>(room);
    row_min_ = memory.template allocate<std::uint16_t>(room);
    row_count_ = memory.template allocate<std::uint8_t>(room);
  }

  /// Paints in another shape from now on, for which there is room.
  void reshape(const RangeImageShape& shape) noexcept { projection_ = ImageProjection(shape); }

  /// Paints the valid points of a scan, sensor frame, into `projection().pixels()` pixels, units
  /// of 1 / `kRangeUnitsPerMetre`. O(points + pixels).
  void paint(const PointView& points, std::uint16_t* pixels) noexcept;

  /// How directions map to pixels.
  [[nodiscard]] const ImageProjection& projection() const noexcept { return projection_; }

 private:
  void collect(const PointView& points) noexcept;
  void filter(std::uint16_t* pixels) noexcept;

  RangePainterConfig config_;
  ImageProjection projection_;
  std::uint16_t* nearest_ = nullptr;  ///< smallest range per pixel, 0xFFFF = no return
  std::uint16_t* row_min_ = nullptr;  ///< horizontal pass of the filter
  std::uint8_t* row_count_ = nullptr;
};

}  // namespace unimapper
