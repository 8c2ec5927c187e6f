#include "unimapper/free_space/inverse_sensor_model.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>

namespace unimapper {
namespace {

constexpr std::size_t kPointsPerBatch = 256;

}  // namespace

void InverseSensorModel::add(const std::uint16_t* pixels, const ImageProjection& projection,
                             const Eigen::Matrix3f& R_sensor_points,
                             const Eigen::Vector3f& t_sensor_points, const ObservedPoints& points,
                             VectorWidth width) const noexcept {
  run_vectorised(width, [&]() UNIMAPPER_VECTORISED {
    // Copies, so that the compiler knows them to be constant in the loops.
    const ImageProjection to_pixel = projection;
    const InverseSensorModel model = *this;
    // NOLINTBEGIN(performance-unnecessary-copy-initialization)
    const Eigen::Matrix3f r = R_sensor_points;
    const Eigen::Vector3f t = t_sensor_points;
    // NOLINTEND(performance-unnecessary-copy-initialization)
    std::int32_t pixel[kPointsPerBatch];
    float range_m[kPointsPerBatch];
    for (std::size_t first = 0; first < points.size; first += kPointsPerBatch) {
      const std::size_t size = std::min(kPointsPerBatch, points.size - first);
      const float* const px = points.x + first;
      const float* const py = points.y + first;
      const float* const pz = points.z + first;
      for (std::size_t i = 0; i < size; ++i) {
        const auto target =
            to_pixel.look_up(r(0, 0) * px[i] + r(0, 1) * py[i] + r(0, 2) * pz[i] + t.x(),
                             r(1, 0) * px[i] + r(1, 1) * py[i] + r(1, 2) * pz[i] + t.y(),
                             r(2, 0) * px[i] + r(2, 1) * py[i] + r(2, 2) * pz[i] + t.z());
        pixel[i] = target.pixel;
        // Nothing measured reaches that far.
        range_m[i] = target.inside != 0 ? target.range_m : std::numeric_limits<float>::infinity();
      }
#pragma GCC unroll 4
      for (std::size_t i = 0; i < size; ++i) pixel[i] = pixels[pixel[i]];
      std::int32_t* const log_odds = points.log_odds + first;
      for (std::size_t i = 0; i < size; ++i) log_odds[i] += model.weigh(pixel[i], range_m[i]);
    }
  });
}

}  // namespace unimapper
