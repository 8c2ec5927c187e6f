// Motion of constant velocity, without trigonometric functions.
#pragma once

#include <cstdint>

#include "unimapper/core/pose.hpp"

namespace unimapper::odometry {

/// Velocity of the sensor in its own frame.
struct Velocity {
  Eigen::Vector3d linear_m_s = Eigen::Vector3d::Zero();     ///< of the sensor's origin
  Eigen::Vector3d angular_rad_s = Eigen::Vector3d::Zero();  ///< about the sensor's axes
};

/// Longest time between samples of an IMU: longer ones hide a turn.
inline constexpr std::int64_t kLongestGap_ns = 50'000'000;

/// Of two stamps whose difference does not overflow.
[[nodiscard]] inline double seconds_between(std::int64_t from_ns, std::int64_t to_ns) noexcept {
  return static_cast<double>(to_ns - from_ns) * 1e-9;
}

/// The rotation by `angle_rad` (a rotation vector of at most a few turns). Series and products
/// alone: the same bits on every machine.
[[nodiscard]] Eigen::Matrix3d rotation_of(const Eigen::Vector3d& angle_rad) noexcept;

/// The rotation vector of a rotation, at most pi long. Series, products and roots alone.
[[nodiscard]] Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& rotation) noexcept;

/// T_before_after of a sensor that moves at `velocity` for so long: `seconds` may be negative.
[[nodiscard]] Pose moved(const Velocity& velocity, double seconds) noexcept;

/// The velocity at which `moved` gives `T_before_after` after `seconds`.
[[nodiscard]] Velocity velocity_of(const Pose& T_before_after, double seconds) noexcept;

}  // namespace unimapper::odometry
