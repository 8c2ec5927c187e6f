// Probing of a registration along the axis its surfaces know least.
#include "weak_axis.hpp"

#include <algorithm>
#include <cmath>

#include "overlap_distances.hpp"
#include "unimapper/core/cholesky.hpp"
#include "unimapper/core/symmetric_eigen.hpp"

namespace unimapper::merge {
namespace {

// Of the overlap of the result, what a restart must reach to fit as well.
constexpr double kFitsAsWell = 0.9;

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
  const double fit = overlap_at(target, source, result.T_target_source);
  for (const double side : {-1.0, 1.0}) {
    Pose start = result.T_target_source;
    start.translation += side * config.probe_m * weak.axis;
    const RegistrationResult again =
        register_clouds(target, source, start, config, tilt_information);
    const double slip = std::abs(
        weak.axis.dot(again.T_target_source.translation - result.T_target_source.translation));
    if (slip <= weak.slip_m) continue;
    if (overlap_at(target, source, again.T_target_source) < kFitsAsWell * fit) continue;
    weak.slip_m = slip;
  }
  return weak;
}

Matrix6d weakened(const Matrix6d& information, const Eigen::Vector3d& axis,
                  const RegistrationConfig& config) {
  Matrix6d covariance = Cholesky<6>(information).inverse();
  covariance.topLeftCorner<3, 3>() +=
      config.weak_axis_sigma_m * config.weak_axis_sigma_m * axis * axis.transpose();
  return Cholesky<6>(covariance).inverse();
}

}  // namespace unimapper::merge
