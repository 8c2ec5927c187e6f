#include "unimapper/free_space/inverse_sensor_model.hpp"

#include <algorithm>
#include <cstddef>

namespace unimapper {
namespace {

constexpr std::size_t kPointsPerBatch = 256;

}  // namespace

void InverseSensorModel::add(const std::uint16_t* pixels, const ImageProjection& projection,
                             const Eigen::Matrix3f& R_sensor_points,
                             const Eigen::Vector3f& t_sensor_points,
                             const ObservedPoints& points) const noexcept {
  // Copies, so that the compiler knows them to be constant in the loops.
  const Eigen::Matrix3f r = R_sensor_points;
  const Eigen::Vector3f t = t_sensor_points;
  float x[kPointsPerBatch];
  float y[kPointsPerBatch];
  float z[kPointsPerBatch];
  float range_m[kPointsPerBatch];
  std::int32_t pixel[kPointsPerBatch];
  std::int32_t measured[kPointsPerBatch];
  for (std::size_t first = 0; first < points.size; first += kPointsPerBatch) {
    const std::size_t size = std::min(kPointsPerBatch, points.size - first);
    for (std::size_t i = 0; i < size; ++i) {
      const float px = points.x[first + i];
      const float py = points.y[first + i];
      const float pz = points.z[first + i];
      x[i] = r(0, 0) * px + r(0, 1) * py + r(0, 2) * pz + t.x();
      y[i] = r(1, 0) * px + r(1, 1) * py + r(1, 2) * pz + t.y();
      z[i] = r(2, 0) * px + r(2, 1) * py + r(2, 2) * pz + t.z();
    }
    projection.project(x, y, z, size, pixel, range_m);
    for (std::size_t i = 0; i < size; ++i) {
      measured[i] = pixel[i] == ImageProjection::kOutside ? kNoRange : pixels[pixel[i]];
    }
    weigh(measured, range_m, size, points.log_odds + first);
  }
}

void InverseSensorModel::weigh(const std::int32_t* __restrict measured,
                               const float* __restrict range_m, std::size_t count,
                               std::int32_t* __restrict log_odds) const noexcept {
  // Copies, as above.
  const VisibilityTest visibility = visibility_;
  const EvidenceWeights weights = weights_;
  constexpr float kEverywhere_m = 1e30F;
  const float full_m = full_weight_range_m_ > 0.0F ? full_weight_range_m_ : kEverywhere_m;
  const float scaled = static_cast<float>(weights.free) * full_m;
  for (std::size_t i = 0; i < count; ++i) {
    const float beyond_m = range_m[i] > full_m ? range_m[i] : full_m;
    const auto reduced = static_cast<std::int32_t>(scaled / beyond_m);
    const std::int32_t free = range_m[i] > full_m ? reduced : weights.free;
    const Visibility is = visibility.look(measured[i], range_m[i]);
    log_odds[i] += (free & is.seen_through) - (weights.weakly_occupied & is.surface);
  }
}

}  // namespace unimapper
