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
      if (pixel[i] == ImageProjection::kOutside) continue;
      switch (visibility_.look(pixels[pixel[i]], range_m[i])) {
        case Visibility::kSeenThrough:
          points.log_odds[first + i] += free_at(range_m[i]);
          break;
        case Visibility::kSurface:
          points.log_odds[first + i] -= weights_.weakly_occupied;
          break;
        case Visibility::kUnknown:
          break;
      }
    }
  }
}

std::int32_t InverseSensorModel::free_at(float range_m) const noexcept {
  if (!(full_weight_range_m_ > 0.0F) || range_m <= full_weight_range_m_) return weights_.free;
  return static_cast<std::int32_t>(static_cast<float>(weights_.free) * full_weight_range_m_ /
                                   range_m);
}

}  // namespace unimapper
