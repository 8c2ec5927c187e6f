// Rigid transforms.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

namespace unimapper {

/// A rigid transform. `T_world_sensor` maps coordinates of the sensor frame to the world frame:
/// p_world = T_world_sensor * p_sensor. Its members have no over-aligned type, so the layout is
/// the same whatever instruction set a consumer compiles for.
struct Pose {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< orthonormal, determinant 1
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();   ///< metres

  Pose() = default;
  Pose(const Eigen::Matrix3d& r, const Eigen::Vector3d& t) : rotation(r), translation(t) {}
  /// `q` need not be normalised.
  Pose(const Eigen::Quaterniond& q, const Eigen::Vector3d& t)
      : rotation(q.normalized().toRotationMatrix()), translation(t) {}

  /// T_b_a of T_a_b.
  [[nodiscard]] Pose inverse() const {
    const Eigen::Matrix3d r = rotation.transpose();
    return {r, -(r * translation)};
  }
  friend Pose operator*(const Pose& a, const Pose& b) {
    return {a.rotation * b.rotation, a.rotation * b.translation + a.translation};
  }
  friend Eigen::Vector3d operator*(const Pose& a, const Eigen::Vector3d& p) {
    return a.rotation * p + a.translation;
  }
  /// The rotation as a unit quaternion.
  [[nodiscard]] Eigen::Quaterniond quaternion() const noexcept;
  /// True if no number is infinite or NaN.
  [[nodiscard]] bool is_finite() const noexcept;
  /// True if finite and the rotation part is a rotation within `tolerance`.
  [[nodiscard]] bool is_rigid(double tolerance = 1e-3) const noexcept;
};

inline constexpr double kDegreesPerRadian = 57.295779513082320877;

/// The matrix that takes w to v x w.
[[nodiscard]] inline Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

/// Angle of a rotation in radians, in [0, pi].
[[nodiscard]] inline double rotation_angle(const Eigen::Matrix3d& r) {
  const double s =
      0.5 * Eigen::Vector3d(r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1)).norm();
  return std::atan2(s, 0.5 * (r.trace() - 1.0));
}

/// The gravity-levelled frame at a sensor pose: same origin, z along `up`, x along the sensor's
/// horizontal heading (paper section VI, "ego-centric keyframe coordinate system"). Returns
/// T_world_level. `up`: unit vector in the world frame.
[[nodiscard]] Pose level_frame(const Pose& T_world_sensor,
                               const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ()) noexcept;

}  // namespace unimapper
