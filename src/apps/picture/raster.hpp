// Rasterisation of points seen from above.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "src/apps/picture/image.hpp"

namespace unimapper::apps {

/// A piece of the map's ground plane and the pixels it is shown with; y points up.
struct Frame {
  double min_x = 0.0;
  double max_y = 0.0;
  double metres_per_pixel = 1.0;
  std::size_t width = 1;
  std::size_t height = 1;

  /// Pixel coordinates of a map position; fractions are within a pixel.
  [[nodiscard]] Eigen::Vector2d pixel(double x, double y) const {
    return {(x - min_x) / metres_per_pixel, (max_y - y) / metres_per_pixel};
  }
};

/// Bounds of the relevant part of the plane.
class Extent {
 public:
  /// A map point; the outermost 0.2 % on each side may be cut off.
  void add_scenery(double x, double y) {
    if (is_on_earth(x, y)) scenery_.emplace_back(x, y);
  }
  /// A robot position: always shown; map points only up to 65 m around these.
  void add_path(double x, double y) {
    if (is_on_earth(x, y)) path_.emplace_back(x, y);
  }

  /// A frame with a margin, at most `max_pixels` wide and high, no finer than
  /// `min_metres_per_pixel`. A few metres around the origin when empty.
  [[nodiscard]] Frame fit(std::size_t max_pixels, double min_metres_per_pixel) const;

 private:
  struct Range {
    double from;
    double to;
  };
  [[nodiscard]] Range range(int axis) const;
  /// False for NaN and for coordinates beyond any map.
  static bool is_on_earth(double x, double y) { return std::abs(x) < 1e7 && std::abs(y) < 1e7; }

  std::vector<Eigen::Vector2f> scenery_;
  std::vector<Eigen::Vector2d> path_;
};

/// Calls `visit(pixel_index, share)` for the pixels under a square of `size_m` (at least a
/// pixel) around a position, `share` in (0, 1] being the part of the pixel that is covered:
/// voxels larger than a pixel leave no gaps and edges fall where they are.
template <typename Visit>
void for_covered_pixels(const Frame& frame, double x, double y, double size_m, Visit visit) {
  const double size = std::max(1.0, size_m / frame.metres_per_pixel);
  const Eigen::Vector2d center = frame.pixel(x, y);
  const double left = center.x() - 0.5 * size;
  const double top = center.y() - 0.5 * size;
  const auto width = static_cast<long>(frame.width);
  const auto height = static_cast<long>(frame.height);
  // Also false for NaN.
  const bool visible = left + size > 0.0 && top + size > 0.0 && left < static_cast<double>(width) &&
                       top < static_cast<double>(height);
  if (!visible) return;
  const auto overlap = [size](double begin, long cell) {
    return std::min(begin + size, static_cast<double>(cell) + 1.0) -
           std::max(begin, static_cast<double>(cell));
  };
  const long x_end = std::min(static_cast<long>(std::floor(left + size)), width - 1);
  const long y_end = std::min(static_cast<long>(std::floor(top + size)), height - 1);
  for (long py = std::max(static_cast<long>(std::floor(top)), 0L); py <= y_end; ++py) {
    for (long px = std::max(static_cast<long>(std::floor(left)), 0L); px <= x_end; ++px) {
      const double share = overlap(left, px) * overlap(top, py);
      if (share > 0.0) visit(static_cast<std::size_t>(py * width + px), static_cast<float>(share));
    }
  }
}

/// Accumulated amount and colour of every pixel.
class Layer {
 public:
  explicit Layer(const Frame& frame)
      : frame_(frame), amounts_(frame.width * frame.height), colors_(frame.width * frame.height) {}

  void add(double x, double y, double size_m, const Rgb& color) {
    for_covered_pixels(frame_, x, y, size_m, [&](std::size_t pixel, float share) {
      amounts_[pixel] += share;
      colors_[pixel] = colors_[pixel] + color * share;
    });
  }

  [[nodiscard]] float amount(std::size_t pixel) const { return amounts_[pixel]; }
  /// Mean colour over a pixel with a positive amount.
  [[nodiscard]] Rgb color(std::size_t pixel) const {
    return colors_[pixel] * (1.0F / amounts_[pixel]);
  }
  /// The amount that `share` of the pixels that have any stay below; 1 if there are none.
  [[nodiscard]] float quantile(double share) const;

 private:
  Frame frame_;
  std::vector<float> amounts_;
  std::vector<Rgb> colors_;
};

}  // namespace unimapper::apps
