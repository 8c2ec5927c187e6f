#include "unimapper/core/image_projection.hpp"

#include <algorithm>
#include <cmath>

#include "unimapper/core/angles.hpp"
#include "unimapper/core/vector_width.hpp"

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

  const auto row_of = [&](float elevation_deg) {
    return (static_cast<float>(sin_deg(elevation_deg)) - low) * rows_per_sine_;
  };
  // At the pole there is no room for slack; a lower image than two slacks has none either.
  const bool has_slack = shape.elevation_max_deg - shape.elevation_min_deg > 2.0F * kImageSlackDeg;
  const bool below = has_slack && shape.elevation_min_deg > -90.0F;
  const bool above = has_slack && shape.elevation_max_deg < 90.0F;
  first_measured_row_ = below ? row_of(shape.elevation_min_deg + kImageSlackDeg) : 0.0F;
  end_measured_row_ =
      above ? row_of(shape.elevation_max_deg - kImageSlackDeg) : static_cast<float>(rows_);
}

void ImageProjection::project(const float* __restrict x, const float* __restrict y,
                              const float* __restrict z, std::size_t count,
                              std::int32_t* __restrict pixel,
                              float* __restrict range_m) const noexcept {
  run_vectorised(widest_vectors(), [&]() UNIMAPPER_VECTORISED {
    // Copies, so that the compiler knows them to be constant in the loop.
    const ImageProjection projection = *this;
    const std::size_t points = count;
    const float* __restrict const from_x = x;
    const float* __restrict const from_y = y;
    const float* __restrict const from_z = z;
    std::int32_t* __restrict const to_pixel = pixel;
    float* __restrict const to_range_m = range_m;
    for (std::size_t i = 0; i < points; ++i) {
      const Target target = projection.project(from_x[i], from_y[i], from_z[i]);
      to_pixel[i] = target.pixel | ~target.inside;
      to_range_m[i] = target.range_m;
    }
  });
}

}  // namespace unimapper
