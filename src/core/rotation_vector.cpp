#include "src/core/rotation_vector.hpp"

#include <cmath>

#include "unimapper/core/pose.hpp"

namespace unimapper {

Eigen::Matrix3d rotation_of(const Eigen::Vector3d& angle_rad) noexcept {
  Eigen::Vector3d half = 0.5 * angle_rad;
  constexpr double kSmall_rad = 0.125;
  constexpr int kMostHalvings = 16;
  int halvings = 0;
  while (halvings < kMostHalvings && !(half.squaredNorm() <= kSmall_rad * kSmall_rad)) {
    half *= 0.5;
    ++halvings;
  }
  // Taylor series of sin(x) / x and cos(x); below 1e-16 from the next term on.
  const double s = half.squaredNorm();
  const double sinc = 1.0 - s / 6.0 * (1.0 - s / 20.0 * (1.0 - s / 42.0 * (1.0 - s / 72.0)));
  double w = 1.0 - s / 2.0 * (1.0 - s / 12.0 * (1.0 - s / 30.0 * (1.0 - s / 56.0)));
  Eigen::Vector3d v = sinc * half;
  for (int i = 0; i < halvings; ++i) {
    v *= 2.0 * w;
    w = 2.0 * w * w - 1.0;
  }
  return Eigen::Quaterniond(w, v.x(), v.y(), v.z()).normalized().toRotationMatrix();
}

Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& rotation) noexcept {
  const Eigen::Quaterniond q = Pose{rotation, Eigen::Vector3d::Zero()}.quaternion();
  double w = q.w();
  Eigen::Vector3d v = q.vec();
  if (!(w * w + v.squaredNorm() > 0.0)) return Eigen::Vector3d::Zero();
  if (w < 0.0) {
    w = -w;
    v = -v;
  }
  // Halves the angle until the series of asin(x) / x needs few terms.
  constexpr double kSmall = 0.125;
  constexpr int kMostHalvings = 8;
  double doublings = 2.0;
  for (int i = 0; i < kMostHalvings && v.squaredNorm() > kSmall * kSmall; ++i) {
    const double half = std::sqrt(0.5 * (1.0 + w));
    v /= 2.0 * half;
    w = half;
    doublings *= 2.0;
  }
  const double s = v.squaredNorm();
  const double series =
      1.0 + s * (1.0 / 6.0 + s * (3.0 / 40.0 + s * (15.0 / 336.0 +
                                                    s * (105.0 / 3456.0 + s * (945.0 / 42240.0)))));
  return doublings * series * v;
}

}  // namespace unimapper
