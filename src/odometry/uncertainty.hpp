// Uncertainty of the motion from scan to scan.
#pragma once

#include "registration.hpp"
#include "unimapper/odometry/odometry.hpp"

namespace unimapper::odometry {

/// Covariance of each scan's motion, and what is known of the motion along weak axes.
class WeakMotion {
 public:
  /// Takes a scan that was registered, `seconds` after the one before, and whose stamp is `ahead_s`
  /// after the middle of its points. `R_sensor_odometry` turns the odometry frame's axes into the
  /// sensor's. The covariance is as in `OdometryResult`.
  Matrix6d add(const Registered& found, double seconds, double ahead_s,
               const Eigen::Matrix3d& R_sensor_odometry) noexcept;

  /// The covariance of a motion of which nothing is known but the time it took.
  Matrix6d lose(double seconds) noexcept;

  /// Weak axes of the scan that was added last, in the sensor's frame.
  [[nodiscard]] WeakAxes axes(const Eigen::Matrix3d& R_sensor_odometry) const noexcept;

  /// Whether so small a share of the points says much about an axis that it is weak.
  [[nodiscard]] static bool is_weak(double share) noexcept { return !(share > kWeak); }

  /// Whether a scan that determined all axes has shown a velocity since the start.
  [[nodiscard]] bool is_velocity_known() const noexcept { return is_velocity_known_; }

 private:
  static constexpr double kWeak = 0.002;

  [[nodiscard]] double variance_after(double seconds, bool is_rotation) const noexcept;

  Determination determination_;
  bool is_weak_[6] = {};
  double weak_s_[2] = {};  // for how long axes of translation and of rotation have been weak
  bool is_velocity_known_ = false;
};

/// Which axes are weak, in words; empty if none is.
[[nodiscard]] const char* reason_of(const WeakAxes& weak) noexcept;

}  // namespace unimapper::odometry
