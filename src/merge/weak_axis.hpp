// Probing of a registration along the axis its surfaces know least.
#pragma once

#include <Eigen/Core>

#include "unimapper/merge/registration.hpp"

namespace unimapper::merge {

/// What restarts of a registration on either side of its result found.
struct WeakAxis {
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  ///< in the target's frame, of length one
  /// How far along the axis a restart ended from the result, metres; beyond `probe_slip_m` only
  /// where the clouds fit as well.
  double slip_m = 0.0;
};

/// Restarts a converged registration `probe_m` before and behind its result along the weakest axis
/// of its normal equations. Where surfaces hold the pose, both come back; in a smooth tunnel they
/// stay, whatever the normal equations claim. Costs two registrations at most: one that comes back
/// ends where it is near.
[[nodiscard]] WeakAxis probe_weak_axis(const RegistrationCloud& target,
                                       const RegistrationCloud& source,
                                       const RegistrationResult& result,
                                       const RegistrationConfig& config,
                                       const Eigen::Matrix2d& tilt_information);

/// The information of a result whose weak axis slipped: along it the pose is known to
/// `weak_axis_sigma_m`.
[[nodiscard]] Matrix6d weakened(const Matrix6d& information, const Eigen::Vector3d& axis,
                                const RegistrationConfig& config);

}  // namespace unimapper::merge
