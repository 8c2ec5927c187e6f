// Prior on the relative tilt of two keyframes.
#pragma once

#include <Eigen/Core>

#include "unimapper/core/keyframe.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper {

/// How far a keyframe's z axis is from up, standard deviation, where neither its walls nor
/// `OdometryConfig::up_sigma_deg` tell; measured.
inline constexpr float kUnknownUpSigmaDeg = 1.25F;

/// A loop that is tilted by more standard deviations is refused: by the search for loops, on the
/// robot and at the base, and by their verification.
inline constexpr double kMaxTiltSigmas = 4.0;

/// The tilt of a relative pose: x and y of the query's z axis in the match's frame, rad.
[[nodiscard]] inline Eigen::Vector2d tilt_of(const Pose& T_match_query) noexcept {
  return T_match_query.rotation.col(2).head<2>();
}

/// The pose with another tilt (shorter than 1), its turn about the vertical kept; the translation
/// stays as it is.
[[nodiscard]] Pose with_tilt(const Pose& T_match_query, const Eigen::Vector2d& tilt) noexcept;

/// What is known of the tilt of a relative pose before anything is matched: it is zero, with the
/// covariance of both keyframes' up. Where a keyframe does not know up, its z axis is up within
/// `kUnknownUpSigmaDeg`. No heap; the same bits on every machine.
class TiltPrior {
 public:
  /// `T_match_query`: of which only the turn about the vertical counts.
  TiltPrior(const KeyframeUp& match, const KeyframeUp& query, const Pose& T_match_query) noexcept;

  /// Inverse of the tilt's covariance, 1/rad².
  [[nodiscard]] Eigen::Matrix2d information() const noexcept { return information_; }

  /// By how many standard deviations a tilt contradicts the prior that was measured with
  /// `measured` as its information, 1/rad².
  [[nodiscard]] double sigmas(const Eigen::Vector2d& tilt,
                              const Eigen::Matrix2d& measured) const noexcept;

  /// By how many standard deviations a tilt contradicts the prior. The tilt was measured with the
  /// standard deviation `sigma` in every direction, rad.
  [[nodiscard]] double sigmas(const Eigen::Vector2d& tilt, double sigma) const noexcept;

  /// Mean of prior and measurement, each weighted by its information.
  [[nodiscard]] Eigen::Vector2d posterior(const Eigen::Vector2d& tilt,
                                          const Eigen::Matrix2d& measured) const noexcept;

 private:
  // Without alignment of their own the layout is the same whatever instruction set a file is
  // compiled for.
  using Matrix = Eigen::Matrix<double, 2, 2, Eigen::DontAlign>;
  Matrix covariance_;
  Matrix information_;
};

/// Derivative of a pose's tilt by a turn about the match's axes (added on the left), for normal
/// equations.
[[nodiscard]] inline Eigen::Matrix<double, 2, 3> tilt_derivative(
    const Pose& T_match_query) noexcept {
  const Eigen::Vector3d up = T_match_query.rotation.col(2);
  Eigen::Matrix<double, 2, 3> derivative;
  derivative << 0.0, up.z(), -up.y(), -up.z(), 0.0, up.x();
  return derivative;
}

}  // namespace unimapper
