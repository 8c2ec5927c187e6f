#include "motion.hpp"

namespace unimapper::odometry {

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
