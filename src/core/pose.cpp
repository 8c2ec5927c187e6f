#include "unimapper/core/pose.hpp"

namespace unimapper {

// Inlined it would leave a copy of Eigen's conversion that a program's own could replace.
[[gnu::noinline]] Eigen::Quaterniond Pose::quaternion() const noexcept {
  return Eigen::Quaterniond(rotation).normalized();
}

bool Pose::is_finite() const noexcept { return rotation.allFinite() && translation.allFinite(); }

bool Pose::is_rigid(double tolerance) const noexcept {
  return is_finite() &&
         (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() <
             tolerance &&
         rotation.determinant() > 0.0;
}

Pose level_frame(const Pose& T_world_sensor, const Eigen::Vector3d& up) noexcept {
  const auto horizontal = [&up](const Eigen::Vector3d& v) -> Eigen::Vector3d {
    return v - up.dot(v) * up;
  };
  Eigen::Vector3d heading = horizontal(T_world_sensor.rotation.col(0));
  // A sensor that looks straight up or down has no heading in x; its y axis then lies level.
  if (heading.squaredNorm() < 1e-6) {
    heading = horizontal(T_world_sensor.rotation.col(1).cross(up));
  }
  heading.normalize();
  Pose level;
  level.rotation.col(0) = heading;
  level.rotation.col(1) = up.cross(heading);
  level.rotation.col(2) = up;
  level.translation = T_world_sensor.translation;
  return level;
}

}  // namespace unimapper
