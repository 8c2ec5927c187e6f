#include "image_judge.hpp"

#include <algorithm>
#include <cstddef>
#include <span>

namespace unimapper::onboard {
namespace {

constexpr std::size_t kPlacesAtOnce = 256;

}  // namespace

ImageJudge::ImageJudge(const PipelineConfig& config) noexcept
    : margin_m_(config.free_space.range_margin_m),
      margin_scale_(1.0F + config.free_space.range_margin_relative),
      full_weight_range_m_(config.free_space.full_weight_range_m),
      free_(in_thousandths(config.removal.log_odds_free)),
      weakly_occupied_(in_thousandths(config.removal.log_odds_weakly_occupied)) {}

void ImageJudge::add(const KeyframeEvidence& evidence, std::uint32_t stride,
                     const ImageProjection& projection, const Grid& grid,
                     const JudgedPlaces& places) const noexcept {
  const Eigen::Vector3f offset = (grid.origin_m() - evidence.grid.origin_m()).cast<float>();
  const std::span<const RangeImage> images = evidence.painted();
  for (std::size_t i = images.empty() ? 0 : (images.size() - 1) % stride; i < images.size();
       i += stride) {
    add_image(images[i], projection, offset, places);
  }
}

void ImageJudge::add_image(const RangeImage& image, const ImageProjection& projection,
                           const Eigen::Vector3f& image_grid_from_places_m,
                           const JudgedPlaces& places) const noexcept {
  const Eigen::Matrix3f r = image.R_grid_sensor.transpose();
  const Eigen::Vector3f t = r * (image_grid_from_places_m - image.t_grid_sensor);
  float x[kPlacesAtOnce];
  float y[kPlacesAtOnce];
  float z[kPlacesAtOnce];
  float range_m[kPlacesAtOnce];
  std::int32_t pixel[kPlacesAtOnce];
  for (std::size_t first = 0; first < places.size; first += kPlacesAtOnce) {
    const std::size_t size = std::min(kPlacesAtOnce, places.size - first);
    for (std::size_t i = 0; i < size; ++i) {
      const float px = places.x[first + i];
      const float py = places.y[first + i];
      const float pz = places.z[first + i];
      x[i] = r(0, 0) * px + r(0, 1) * py + r(0, 2) * pz + t.x();
      y[i] = r(1, 0) * px + r(1, 1) * py + r(1, 2) * pz + t.y();
      z[i] = r(2, 0) * px + r(2, 1) * py + r(2, 2) * pz + t.z();
    }
    projection.project(x, y, z, size, pixel, range_m);
    for (std::size_t i = 0; i < size; ++i) {
      if (pixel[i] == ImageProjection::kOutside) continue;
      const std::uint16_t seen = image.pixels[pixel[i]];
      if (seen == kNoRange) continue;
      const float seen_m = static_cast<float>(seen) * (1.0F / kRangeUnitsPerMetre);
      const float near = range_m[i] * margin_scale_ + margin_m_;
      const float far = 2.0F * range_m[i] - near;
      if (seen_m > near) {
        places.log_odds[first + i] += free_at(range_m[i]);
      } else if (seen_m > far) {
        places.log_odds[first + i] -= weakly_occupied_;
      }
    }
  }
}

std::int32_t ImageJudge::free_at(float range_m) const noexcept {
  if (!(full_weight_range_m_ > 0.0F) || range_m <= full_weight_range_m_) return free_;
  return static_cast<std::int32_t>(static_cast<float>(free_) * full_weight_range_m_ / range_m);
}

}  // namespace unimapper::onboard
