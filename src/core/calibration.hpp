// Errors of mount, clock and scale that registered motions show, and from where on they are said
#pragma once

#include <cstddef>

#include "src/core/hand_eye.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper {

/// Standard deviations from which a delay or a height counts: drift along a straight road looks
/// like a delay and sway on the level like a height, and more surely than they are.
inline constexpr double kMoreSurely = 8.0;
/// Angles from which an error of the mount is said, and corrected where asked for; degrees.
inline constexpr double kSaid_deg = 0.7;
/// Roll from which it is said: it shows in slight tilts of turns alone; degrees.
inline constexpr double kSaidRoll_deg = 1.5;
/// Lever arms from which an error is said; metres.
inline constexpr double kSaid_m = 0.35;
/// Fewer motions tell nothing.
inline constexpr std::size_t kFewestMotions = 8;

/// A value with its standard deviation.
struct Estimate {
  double value = 0.0;
  double sigma = 0.0;  ///< large where the motion does not show it

  /// Whether it differs from 0 by more than `least`, and by `surely` standard deviations.
  [[nodiscard]] bool is_surely_beyond(double least, double surely = 4.0) const noexcept;
};

/// What registered motions say of the frame whose poses are given, and of its clock.
struct Calibration {
  std::size_t motions = 0;  ///< that were compared; 0: too few, nothing is known
  /// The LiDAR on the frame whose poses are given: the fixed axes x, y, z in this order.
  Estimate roll_deg, pitch_deg, yaw_deg;
  Estimate x_m, y_m, z_m;
  /// Positive where poses are late: the pose of time t is stamped t + delay.
  Estimate delay_s;
  /// Of the given motions, which are to be multiplied by 1 + scale.
  Estimate scale;

  double interval_s = 0.0;  ///< median, from stamp to stamp
  /// By how much roll or pitch of the given poses scatter from scan to scan, against the scans.
  double attitude_noise_deg = 0.0;
  /// Logarithm of how unlikely the motions are with these estimates; without `motions` as well.
  double misfit = 0.0;

  [[nodiscard]] bool shows_rotation() const noexcept;   ///< yaw and pitch to half a degree
  [[nodiscard]] bool shows_lever_arm() const noexcept;  ///< x and y to 0.3 m
  [[nodiscard]] bool shows_delay() const noexcept;      ///< to 0.03 s

  /// Whether twice as many motions would hardly show anything to be said of mount, clock or noise.
  [[nodiscard]] bool is_surely_right() const noexcept;

  /// T_given_lidar of what is sure, the identity in all else.
  [[nodiscard]] Pose sure_mount() const noexcept;
  /// The delay where it is sure, else 0.
  [[nodiscard]] double sure_delay_s() const noexcept;
  /// From which a delay is said, seconds.
  [[nodiscard]] double least_delay_s() const noexcept;
};

/// What a solution says; `motions` stays 0 where no mount and no delay makes the motions agree, or
/// they are too few.
[[nodiscard]] Calibration calibration_of(const HandEye::Solution& solution,
                                         double interval_s) noexcept;

/// The larger one of roll and pitch in the noise of poses, degrees.
[[nodiscard]] double attitude_noise_deg(const Twist& noise) noexcept;

}  // namespace unimapper
