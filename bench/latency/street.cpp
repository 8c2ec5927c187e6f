#include "street.hpp"

#include <algorithm>
#include <cmath>

#include "unimapper/core/voxel_key.hpp"

namespace unimapper::bench {
namespace {

constexpr double kRange_m = 60.0;
constexpr double kSensorHeight_m = 1.8;
constexpr double kHouseLength_m = 15.0;

/// Distance of a house front from the middle of the street, 6 to 14 m.
double front_of(double along_m, bool left) {
  const auto house = static_cast<std::int64_t>(std::floor(along_m / kHouseLength_m));
  const std::uint64_t bits = mix_bits(static_cast<std::uint64_t>(house * 2 + (left ? 1 : 0)));
  return 6.0 + static_cast<double>(bits % 1024) / 128.0;
}

}  // namespace

Eigen::Vector3f Street::cast_ray(double x_m) {
  std::uniform_real_distribution<double> azimuth(-3.14159265, 3.14159265);
  std::uniform_real_distribution<double> elevation(-0.4, 0.2);
  for (;;) {
    const double a = azimuth(random_);
    const double e = elevation(random_);
    const Eigen::Vector3d ray(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
    double range = ray.z() < 0.0 ? kSensorHeight_m / -ray.z() : kRange_m;
    // The first front at or nearer than a depth step is the one that the ray hits.
    for (double depth = 6.0; depth <= 14.0; depth += 1.0) {
      const double to_depth = depth / std::max(std::abs(ray.y()), 1e-6);
      if (to_depth >= range) break;
      if (front_of(x_m + ray.x() * to_depth, ray.y() > 0.0) <= depth) range = to_depth;
    }
    if (range < kRange_m) return (ray * range).cast<float>();
  }
}

std::vector<Eigen::Vector3f> Street::scan(double x_m, std::size_t count) {
  std::vector<Eigen::Vector3f> points(count);
  for (Eigen::Vector3f& point : points) point = cast_ray(x_m);
  return points;
}

}  // namespace unimapper::bench
