// Probing of a registration along the axis its surfaces know least.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "registration.hpp"

namespace unimapper::merge {

/// What restarts of a registration on either side of its result found.
struct WeakAxis {
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  ///< in the target's frame, of length one
  /// How far along the axis a restart ended from the result, metres; beyond `kProbeSlipM` only
  /// where the clouds fit as well.
  double slip_m = 0.0;
};

/// Restarts a converged registration `kProbeM` before and behind its result along the weakest axis
/// of its normal equations. Where surfaces hold the pose, both come back; in a smooth tunnel they
/// stay, whatever the normal equations claim. Costs two registrations at most: one that comes back
/// ends where it is near.
[[nodiscard]] WeakAxis probe_weak_axis(const RegistrationCloud& target,
                                       const RegistrationCloud& source,
                                       const RegistrationResult& result,
                                       const RegistrationConfig& config,
                                       const Eigen::Matrix2d& tilt_information);

/// Along a free axis a loop says nothing: this standard deviation is more than any drift.
inline constexpr double kFreeAxisSigmaM = 1000.0;

/// Whether a variance along an axis, square metres, means that the axis is free.
[[nodiscard]] constexpr bool is_free(double variance) {
  return variance >= 0.25 * kFreeAxisSigmaM * kFreeAxisSigmaM;
}

/// The information of a result whose weak axis slipped: that axis is free.
[[nodiscard]] Matrix6d weakened(const Matrix6d& information, const Eigen::Vector3d& axis);

/// The direction (frame of the loop's match, of length one) along which an information matrix says
/// nothing, if there is one.
[[nodiscard]] std::optional<Eigen::Vector3d> free_axis(const Matrix6d& information);

/// Along a free axis registration stays where it starts, for a right candidate some metres from the
/// truth. This covariance says so: a loop that is farther off is of another place, which looks the
/// same. Without a free axis the covariance stays.
[[nodiscard]] Matrix6d bounded_by_start(const Matrix6d& covariance);

}  // namespace unimapper::merge
