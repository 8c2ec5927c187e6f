// Covariance of slips of the odometry.
#include "src/core/cholesky.hpp"
#include "unimapper/core/keyframe.hpp"

namespace unimapper {

bool is_slip(const SlipCovariance& covariance) noexcept {
  // One weak axis gives two eigenvalues of zero, less than zero by the rounding of floats.
  constexpr double kRounding = 1e-4;
  const double trace = static_cast<double>(covariance.trace());
  if (!(trace > 0.0) || !(covariance.maxCoeff() <= kMostSlip_m2)) return false;
  if (covariance != covariance.transpose()) return false;
  const Eigen::Matrix3d widened =
      covariance.cast<double>() + kRounding * trace * Eigen::Matrix3d::Identity();
  return Cholesky<3>(widened).valid();
}

}  // namespace unimapper
