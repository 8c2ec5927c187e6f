// What range images say about places.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "evidence.hpp"
#include "range_image.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// Places to be judged, metres from a grid's origin, and what was learnt of each: log-odds of
/// "free", thousandths. Structure of arrays.
struct JudgedPlaces {
  const float* x;
  const float* y;
  const float* z;
  std::int32_t* log_odds;
  std::uint32_t size;
};

/// Weighs the visibility of places: seen through, or a surface thereabouts (docs/tuning.md).
class ImageJudge {
 public:
  ImageJudge() = default;
  explicit ImageJudge(const PipelineConfig& config) noexcept;

  /// Adds what every `stride`-th image of a keyframe says, its last one among them, of places in
  /// `grid`. O(places x images).
  void add(const KeyframeEvidence& evidence, std::uint32_t stride,
           const ImageProjection& projection, const Grid& grid,
           const JudgedPlaces& places) const noexcept;

 private:
  void add_image(const RangeImage& image, const ImageProjection& projection,
                 const Eigen::Vector3f& image_grid_from_places_m,
                 const JudgedPlaces& places) const noexcept;
  /// What it weighs that a place at this range was seen through.
  [[nodiscard]] std::int32_t free_at(float range_m) const noexcept;

  float margin_m_ = 0.0F;
  float margin_scale_ = 1.0F;
  float full_weight_range_m_ = 0.0F;
  std::int32_t free_ = 0;
  std::int32_t weakly_occupied_ = 0;
};

/// Log-odds as whole thousandths: evidence for and against often weighs the same, and rounding
/// must not decide such a tie.
[[nodiscard]] inline std::int32_t in_thousandths(float log_odds) noexcept {
  return static_cast<std::int32_t>(log_odds * 1000.0F + 0.5F);
}

}  // namespace unimapper::onboard
