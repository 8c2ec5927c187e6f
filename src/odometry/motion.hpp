// Motion of constant velocity, without trigonometric functions.
#pragma once

#include <cstdint>

#include "src/core/rotation_vector.hpp"
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

/// T_before_after of a sensor that moves at `velocity` for so long: `seconds` may be negative.
[[nodiscard]] Pose moved(const Velocity& velocity, double seconds) noexcept;

/// The velocity at which `moved` gives `T_before_after` after `seconds`.
[[nodiscard]] Velocity velocity_of(const Pose& T_before_after, double seconds) noexcept;

}  // namespace unimapper::odometry
