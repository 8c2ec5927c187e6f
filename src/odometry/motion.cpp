#include "motion.hpp"

#include <cmath>

namespace unimapper::odometry {

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
  const Eigen::Quaterniond q(rotation);
  double w = q.w();
  Eigen::Vector3d v = q.vec();
  const double norm = std::sqrt(w * w + v.squaredNorm());
  if (!(norm > 0.0)) return Eigen::Vector3d::Zero();
  w /= norm;
  v /= norm;
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

Pose moved(const Velocity& velocity, double seconds) noexcept {
  const Eigen::Vector3d angle_rad = velocity.angular_rad_s * seconds;
  // The chord of an arc points along the heading half-way.
  return {rotation_of(angle_rad), rotation_of(0.5 * angle_rad) * (velocity.linear_m_s * seconds)};
}

Velocity velocity_of(const Pose& T_before_after, double seconds) noexcept {
  const Eigen::Vector3d angle_rad = rotation_vector(T_before_after.rotation);
  const Eigen::Vector3d chord_m =
      rotation_of(0.5 * angle_rad).transpose() * T_before_after.translation;
  return {chord_m / seconds, angle_rad / seconds};
}

}  // namespace unimapper::odometry
