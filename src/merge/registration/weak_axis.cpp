// Probing of a registration along the axis its surfaces know least.
#include "weak_axis.hpp"

#include <algorithm>
#include <cmath>

#include "overlap_distances.hpp"
#include "src/core/cholesky.hpp"
#include "src/core/symmetric_eigen.hpp"

namespace unimapper::merge {
namespace {

// Of the overlap of the result, what a restart must reach to fit as well.
constexpr double kFitsAsWell = 0.9;

// A restart that has come so near the result, as a share of `kProbeSlipM`, is back: registration
// converges from much farther off, and the last iterations take the longest.
constexpr double kBack = 0.2;

double overlap_at(const RegistrationCloud& target, const RegistrationCloud& source,
                  const Pose& pose) {
  return structure_overlap(target, source, pose, kOverlapRadiusM, kFineDistanceM);
}

}  // namespace

WeakAxis probe_weak_axis(const RegistrationCloud& target, const RegistrationCloud& source,
                         const RegistrationResult& result, const RegistrationConfig& config,
                         const Eigen::Matrix2d& tilt_information) {
  const Matrix6d covariance = Cholesky<6>(result.information).inverse();
  WeakAxis weak;
  weak.axis = symmetric_eigen<double>(covariance.topLeftCorner<3, 3>()).vectors.col(2);
  const auto slip_of = [&](const Pose& pose) {
    return std::abs(weak.axis.dot(pose.translation - result.T_target_source.translation));
  };
  const auto is_back = [&](const Pose& pose) {
    return slip_of(pose) <= kBack * RegistrationConfig::kProbeSlipM;
  };
  for (const double side : {-1.0, 1.0}) {
    Pose start = result.T_target_source;
    start.translation += side * RegistrationConfig::kProbeM * weak.axis;
    const Pose again = registered_pose(target, source, start, config, tilt_information, is_back);
    const double slip = slip_of(again);
    if (slip <= weak.slip_m) continue;
    // How well a restart fits matters only where it is far enough off.
    if (slip > RegistrationConfig::kProbeSlipM &&
        overlap_at(target, source, again) <
            kFitsAsWell * overlap_at(target, source, result.T_target_source)) {
      continue;
    }
    weak.slip_m = slip;
  }
  return weak;
}

Matrix6d weakened(const Matrix6d& information, const Eigen::Vector3d& axis) {
  Matrix6d covariance = Cholesky<6>(information).inverse();
  covariance.topLeftCorner<3, 3>() += kFreeAxisSigmaM * kFreeAxisSigmaM * axis * axis.transpose();
  return Cholesky<6>(covariance).inverse();
}

std::optional<Eigen::Vector3d> free_axis(const Matrix6d& information) {
  const Matrix6d covariance = Cholesky<6>(information).inverse();
  const auto eigen = symmetric_eigen<double>(covariance.topLeftCorner<3, 3>());
  if (!is_free(eigen.values[2])) return std::nullopt;
  return eigen.vectors.col(2);
}

Matrix6d bounded_by_start(const Matrix6d& covariance) {
  constexpr double kRightStartSigmaM = 1.0;
  const auto eigen = symmetric_eigen<double>(covariance.topLeftCorner<3, 3>());
  if (!is_free(eigen.values[2])) return covariance;
  const Eigen::Vector3d axis = eigen.vectors.col(2);
  Matrix6d bounded = covariance;
  bounded.topLeftCorner<3, 3>() -=
      (eigen.values[2] - kRightStartSigmaM * kRightStartSigmaM) * axis * axis.transpose();
  return bounded;
}

}  // namespace unimapper::merge
