// Inverse sensor model of range images
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "unimapper/core/image_projection.hpp"
#include "unimapper/core/vector_width.hpp"
#include "unimapper/free_space/evidence_weights.hpp"
#include "unimapper/free_space/range_image.hpp"

namespace unimapper {

/// Points to be observed, metres in any frame, and what was learnt of each: log-odds of "free",
/// thousandths. Structure of arrays.
struct ObservedPoints {
  const float* x;          ///< coordinates, `size` of them
  const float* y;          ///< coordinates, `size` of them
  const float* z;          ///< coordinates, `size` of them
  std::int32_t* log_odds;  ///< one sum per point; observations are added to it
  std::uint32_t size;      ///< points
};

/// What an image says of a point. Masks, -1 or 0, so that loops over them vectorise. Neither: the
/// image knows nothing there, or the point is behind a surface.
struct Visibility {
  std::int32_t seen_through;  ///< clearly in front of a surface
  std::int32_t surface;       ///< a surface about there

  friend bool operator==(const Visibility&, const Visibility&) = default;
};

/// Compares ranges with what an image measured.
class VisibilityTest {
 public:
  VisibilityTest() = default;
  /// A point is seen through if the image's range exceeds its own by more than `margin_m` plus the
  /// share `margin_relative` of its range, and lies at a surface within the same distance.
  VisibilityTest(float margin_m, float margin_relative) noexcept
      : margin_m_(margin_m), margin_scale_(1.0F + margin_relative) {}

  /// Of a point at `range_m` in a direction whose pixel is `pixel`.
  [[nodiscard]] Visibility look(std::int32_t pixel, float range_m) const noexcept {
    const float measured_m = static_cast<float>(pixel) * (1.0F / kRangeUnitsPerMetre);
    const float near = range_m * margin_scale_ + margin_m_;
    const float far = 2.0F * range_m - near;
    const std::int32_t known = pixel != kNoRange ? -1 : 0;
    const std::int32_t beyond_near = measured_m > near ? -1 : 0;
    const std::int32_t beyond_far = measured_m > far ? -1 : 0;
    return {known & beyond_near, known & beyond_far & ~beyond_near};
  }

 private:
  float margin_m_ = 0.0F;
  float margin_scale_ = 1.0F;
};

/// From what a range image measured to log-odds of "free" (the inverse sensor model of occupancy
/// mapping; paper section IV-C and equation 6, docs/tuning.md).
class InverseSensorModel {
 public:
  InverseSensorModel() = default;
  /// What was seen through weighs `weights.free` up to `full_weight_range_m` and in proportion
  /// beyond it; 0 = always in full. A surface about there weighs `weights.weakly_occupied` against.
  InverseSensorModel(const VisibilityTest& visibility, const EvidenceWeights& weights,
                     float full_weight_range_m) noexcept
      : visibility_(visibility), weights_(weights), full_weight_range_m_(full_weight_range_m) {}

  /// Adds what an image tells of points, whose frame `R_sensor_points` and `t_sensor_points` map
  /// to the sensor's, with vectors of any width: the bits are the same. O(points).
  void add(const std::uint16_t* pixels, const ImageProjection& projection,
           const Eigen::Matrix3f& R_sensor_points, const Eigen::Vector3f& t_sensor_points,
           const ObservedPoints& points, VectorWidth width = widest_vectors()) const noexcept;

 private:
  /// Evidence of a point at `range_m` in whose pixel `measured` was. Without branches.
  [[nodiscard]] std::int32_t weigh(std::int32_t measured, float range_m) const noexcept {
    constexpr float kEverywhere_m = 1e30F;
    const float full_m = full_weight_range_m_ > 0.0F ? full_weight_range_m_ : kEverywhere_m;
    const float scaled = static_cast<float>(weights_.free) * full_m;
    const float beyond_m = range_m > full_m ? range_m : full_m;
    const auto reduced = static_cast<std::int32_t>(scaled / beyond_m);
    const std::int32_t free = range_m > full_m ? reduced : weights_.free;
    const Visibility is = visibility_.look(measured, range_m);
    return (free & is.seen_through) - (weights_.weakly_occupied & is.surface);
  }

  VisibilityTest visibility_;
  EvidenceWeights weights_;
  float full_weight_range_m_ = 0.0F;
};

}  // namespace unimapper
