#include "unimapper/core/image_projection.hpp"

#include <algorithm>
#include <cmath>

#include "unimapper/core/angles.hpp"

namespace unimapper {

ImageProjection::ImageProjection(const RangeImageShape& shape) noexcept {
  const float turn = shape.horizontal_fov_deg / 360.0F;
  columns_ = std::max(
      3, static_cast<std::int32_t>(shape.horizontal_fov_deg / shape.azimuth_resolution_deg + 0.5F));
  wraps_ = turn >= 1.0F;
  columns_per_turn_ = static_cast<float>(columns_) / turn;
  first_turn_ = -0.5F * turn;

  const auto low = static_cast<float>(sin_deg(shape.elevation_min_deg));
  const auto high = static_cast<float>(sin_deg(shape.elevation_max_deg));
  rows_ =
      std::max(1, static_cast<std::int32_t>((shape.elevation_max_deg - shape.elevation_min_deg) /
                                                shape.elevation_resolution_deg +
                                            0.5F));
  rows_per_sine_ = static_cast<float>(rows_) / (high - low);
  first_sine_ = low;
}

void ImageProjection::project(const float* __restrict x, const float* __restrict y,
                              const float* __restrict z, std::size_t count,
                              std::int32_t* __restrict pixel,
                              float* __restrict range_m) const noexcept {
  // Copies, so that the compiler knows them to be constant in the loop.
  const ImageProjection p = *this;
  const auto columns = static_cast<float>(p.columns_);
  const auto rows = static_cast<float>(p.rows_);
  const float seam = p.wraps_ ? columns : 2.0F * columns;
  for (std::size_t i = 0; i < count; ++i) {
    const float range = std::sqrt(x[i] * x[i] + y[i] * y[i] + z[i] * z[i]);
    const float sine = z[i] / (range + 1.17549435e-38F);
    float row = (sine - p.first_sine_) * p.rows_per_sine_;
    float column = (direction_turns(x[i], y[i]) - p.first_turn_) * p.columns_per_turn_;
    // Exactly half a turn lies on the seam.
    column = column >= seam ? column - columns : column;
    std::int32_t inside = column >= 0.0F ? -1 : 0;  // a mask; false for NaN
    inside &= column < columns ? -1 : 0;
    inside &= row >= 0.0F ? -1 : 0;
    inside &= row < rows ? -1 : 0;
    row = inside != 0 ? row : 0.0F;
    column = inside != 0 ? column : 0.0F;
    const std::int32_t at =
        static_cast<std::int32_t>(row) * p.columns_ + static_cast<std::int32_t>(column);
    pixel[i] = (at & inside) | ~inside;
    range_m[i] = range;
  }
}

}  // namespace unimapper
