// Hand-eye calibration of mount, clock and scale from given against registered motions
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <limits>
#include <span>

#include "unimapper/core/pose.hpp"

namespace unimapper {

/// Rotation vector (rad) and shift (m).
using Twist = Eigen::Matrix<double, 6, 1>;

/// A motion that was registered, and what the poses say of it.
struct HandEyeMotion {
  Pose registered;   ///< of the LiDAR, T_first_second
  Pose given;        ///< of the frame whose poses are given, at the stamps plus the delay
  Pose given_later;  ///< motion of that frame `HandEye::kLater_s` after it
};

/// Robust least squares (Gauss-Newton, Cauchy weights) of mount, delay and a scale of the
/// odometry: with M the given motion at stamps plus delay and X the mount, X^-1 M X is the
/// registered one. Noise of the poses widens the errors that residuals may have together; it is no
/// evidence for a mount or a delay. No heap, no function of the maths library but the root: the
/// same bits on every machine.
class HandEye {
 public:
  /// Most motions of a step.
  static constexpr std::size_t kMostMotions = 48;
  static constexpr double kLater_s = 0.01;
  static constexpr int kParameters = 8;
  /// roll, pitch, yaw (rad), x, y, z (m), delay (s), scale - 1.
  using Parameters = Eigen::Matrix<double, kParameters, 1>;

  /// `noise`: standard deviations of the given poses, from scan to scan.
  explicit HandEye(const Twist& noise) noexcept;

  /// Delays with other noise would fit one mistake better than another by chance.
  void keep_delay() noexcept { priors_[6] = 0.01; }

  /// What steps find.
  struct Solution {
    Parameters parameters = Parameters::Zero();  ///< the estimate
    Parameters sigmas = Parameters::Zero();      ///< its standard deviations
    Twist scales = Twist::Zero();                ///< of the residuals
    Twist noise = Twist::Zero();                 ///< of the given poses
    /// Logarithm of how unlikely a motion is, with the parameters before the last step.
    double misfit = std::numeric_limits<double>::infinity();
    std::size_t motions = 0;  ///< that were compared

    /// Whether motions that are moved so are those that were registered.
    [[nodiscard]] bool agrees() const noexcept;
  };

  /// Where to begin.
  [[nodiscard]] Solution start(const Parameters& parameters) const noexcept;
  /// A step, with the motions of the solution's delay. False if it has no solution. About 5 us a
  /// motion.
  [[nodiscard]] bool step(std::span<const HandEyeMotion> motions, Solution& s) const noexcept;

  /// T_given_lidar.
  [[nodiscard]] static Pose mount_of(const Parameters& p) noexcept;

 private:
  Parameters priors_;  ///< standard deviations, for what the motion does not show
  Twist noise_;
};

/// The pose `ahead_s` after `at`, by the velocity from `before` to `after`, which are `span_s`
/// apart. Interpolating would smooth noise of the odometry, and so prefer times between the stamps.
[[nodiscard]] Pose moved_on(const Pose& before, const Pose& at, const Pose& after, double span_s,
                            double ahead_s) noexcept;

/// What the third of five poses in a row differs by from the others, scaled so that it has the
/// standard deviation of the noise of one, in the axes of the third. Driving and swaying hardly
/// show in it.
[[nodiscard]] Twist fourth_difference(const std::array<Pose, 5>& poses) noexcept;

/// Median of magnitudes as the standard deviation of normal errors; reorders them. 0 without any.
[[nodiscard]] double scale_of(std::span<double> magnitudes) noexcept;

/// Logarithm of 1 + x, x not negative, to 1e-12: the same bits on every machine.
[[nodiscard]] double log_of_1_plus(double x) noexcept;

}  // namespace unimapper
