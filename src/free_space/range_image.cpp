#include "unimapper/free_space/range_image.hpp"

#include <algorithm>

namespace unimapper {
namespace {

constexpr std::uint16_t kNoReturn = 0xFFFF;
constexpr std::size_t kBatch = 256;

/// A level surface above the sensor, along which ranges fall from ring to ring: between two rings
/// it is nearer than at the lower one, the only one that a pixel's neighbours may hold. A level
/// surface below the sensor is ground, whose label rests on planes.
struct Ceiling {
  float low_sine;    ///< of the lowest elevation around a pixel
  float high_sine;   ///< of the highest one
  float steep_sine;  ///< of two rows above the pixel

  /// Whether both ranges are of one ceiling: equally high above the sensor.
  [[nodiscard]] bool holds(std::uint16_t range, std::uint16_t steep_range) const noexcept {
    constexpr float kLevel = 0.1F * kRangeUnitsPerMetre;
    const float height = steep_sine * static_cast<float>(steep_range);
    return height > low_sine * static_cast<float>(range) - kLevel &&
           height < high_sine * static_cast<float>(range) + kLevel;
  }
};

}  // namespace

void RangePainter::paint(const PointView& points, std::uint16_t* pixels) noexcept {
  std::fill_n(nearest_, projection_.pixels(), kNoReturn);
  collect(points);
  filter(pixels);
}

void RangePainter::collect(const PointView& points) noexcept {
  float x[kBatch];
  float y[kBatch];
  float z[kBatch];
  float range_m[kBatch];
  std::int32_t pixel[kBatch];
  const std::size_t count = std::min(points.count, config_.max_points);
  for (std::size_t first = 0; first < count; first += kBatch) {
    const std::size_t size = std::min(kBatch, count - first);
    for (std::size_t i = 0; i < size; ++i) {
      const Eigen::Vector3f p = points[first + i];
      x[i] = p.x();
      y[i] = p.y();
      z[i] = p.z();
    }
    projection_.project(x, y, z, size, pixel, range_m);
    for (std::size_t i = 0; i < size; ++i) {
      // NaN and infinity fail the comparison.
      if (pixel[i] == ImageProjection::kOutside) continue;
      if (!(range_m[i] >= config_.range_min_m && range_m[i] <= config_.range_max_m)) continue;
      const auto range = static_cast<std::uint16_t>(range_m[i] * kRangeUnitsPerMetre);
      nearest_[pixel[i]] = std::min(nearest_[pixel[i]], range);
    }
  }
}

void RangePainter::filter(std::uint16_t* pixels) noexcept {
  const std::int32_t columns = projection_.columns();
  const std::int32_t rows = projection_.rows();
  for (std::int32_t row = 0; row < rows; ++row) {
    const std::uint16_t* in = nearest_ + row * columns;
    std::uint16_t* out = row_min_ + row * columns;
    std::uint8_t* returns = row_count_ + row * columns;
    const auto combine = [&](std::int32_t at, std::uint16_t left, std::uint16_t right) {
      out[at] = std::min(in[at], std::min(left, right));
      returns[at] = static_cast<std::uint8_t>((in[at] != kNoReturn) + (left != kNoReturn) +
                                              (right != kNoReturn));
    };
    for (std::int32_t at = 1; at + 1 < columns; ++at) combine(at, in[at - 1], in[at + 1]);
    const std::uint16_t before = projection_.wraps() ? in[columns - 1] : kNoReturn;
    const std::uint16_t after = projection_.wraps() ? in[0] : kNoReturn;
    combine(0, before, in[1]);
    combine(columns - 1, in[columns - 2], after);
  }
  for (std::int32_t row = 0; row < rows; ++row) {
    const std::int32_t above = row > 0 ? row - 1 : row;
    const std::int32_t below = row + 1 < rows ? row + 1 : row;
    const bool has_steeper = row + 2 < rows && projection_.sine(row) > 0.0F;
    const Ceiling ceiling{projection_.sine(row - 1), projection_.sine(row + 1),
                          projection_.sine(row + 2)};
    for (std::int32_t column = 0; column < columns; ++column) {
      const std::int32_t at = row * columns + column;
      std::uint16_t nearest = row_min_[at];
      std::uint32_t returns = row_count_[at];
      if (above != row) {
        nearest = std::min(nearest, row_min_[above * columns + column]);
        returns += row_count_[above * columns + column];
      }
      if (below != row) {
        nearest = std::min(nearest, row_min_[below * columns + column]);
        returns += row_count_[below * columns + column];
      }
      if (has_steeper && ceiling.holds(nearest, row_min_[at + 2 * columns])) {
        nearest = std::min(nearest, row_min_[at + 2 * columns]);
      }
      pixels[at] = returns >= config_.min_returns ? nearest : kNoRange;
    }
  }
}

}  // namespace unimapper
