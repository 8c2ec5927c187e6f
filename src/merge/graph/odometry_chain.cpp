// Marginalisation of the keyframes between two others, and back.
#include "odometry_chain.hpp"

#include <Eigen/Geometry>

#include "edge_residual.hpp"
#include "src/core/cholesky.hpp"

namespace unimapper::merge {
namespace {

/// Covariance of the translation and rotation between two keyframes, both in the frame of the
/// session: errors of each step are isotropic but for its slip, and its rotation has a lever to the
/// far end.
Matrix6d chain_covariance(const SessionPath& odometry, std::size_t i, std::size_t j) {
  Matrix6d covariance = Matrix6d::Zero();
  for (std::size_t k = i + 1; k <= j; ++k) {
    const RelativeVariance step = odometry.drift_variance(k - 1, k);
    const Eigen::Matrix3d lever = skew(odometry[j].translation - odometry[k].translation);
    covariance.topLeftCorner<3, 3>() -= step.rotation * (lever * lever);
    covariance.topLeftCorner<3, 3>().diagonal().array() += step.translation;
    covariance.topLeftCorner<3, 3>() += odometry.slip(k - 1, k);
    covariance.topRightCorner<3, 3>() -= step.rotation * lever;
    covariance.bottomRightCorner<3, 3>().diagonal().array() += step.rotation;
  }
  covariance.bottomLeftCorner<3, 3>() = covariance.topRightCorner<3, 3>().transpose();
  return covariance;
}

Pose step_between(const SessionPath& odometry, std::size_t i, std::size_t j) {
  return odometry[i].inverse() * odometry[j];
}

}  // namespace

Matrix6d chain_information(const SessionPath& odometry, std::size_t i, std::size_t j) {
  if (j == i + 1) return odometry.information(i, j);
  Matrix6d into_session = Matrix6d::Zero();
  into_session.topLeftCorner<3, 3>() = odometry[i].rotation;
  into_session.bottomRightCorner<3, 3>() = odometry[j].rotation;
  const Matrix6d information = into_session.transpose() *
                               Cholesky<6>(chain_covariance(odometry, i, j)).inverse() *
                               into_session;
  return 0.5 * (information + information.transpose());
}

void interpolate_chain(const SessionPath& odometry, std::size_t i, std::size_t j,
                       std::vector<Pose>& T_session_keyframe) {
  std::vector<Pose>& poses = T_session_keyframe;
  // What odometry missed by over the whole way, in its own frame.
  const Pose predicted = poses[i] * step_between(odometry, i, j);
  const Eigen::AngleAxisd turn(predicted.rotation.transpose() * poses[j].rotation);
  Vector6d missed;
  missed << odometry[i].rotation * poses[i].rotation.transpose() *
                (poses[j].translation - predicted.translation),
      odometry[j].rotation * (turn.angle() * turn.axis());
  const Vector6d share = Cholesky<6>(chain_covariance(odometry, i, j)).solve(missed);
  for (std::size_t k = i + 1; k < j; ++k) {
    const RelativeVariance variance = odometry.drift_variance(k - 1, k);
    const Eigen::Vector3d lever = odometry[j].translation - odometry[k].translation;
    const Eigen::Vector3d shift =
        variance.translation * share.head<3>() + odometry.slip(k - 1, k) * share.head<3>();
    const Eigen::Vector3d rotation =
        variance.rotation * (share.tail<3>() + lever.cross(share.head<3>()));
    Pose step = step_between(odometry, k - 1, k);
    step.translation += odometry[k - 1].rotation.transpose() * shift;
    poses[k] = poses[k - 1] * step;
    poses[k] = {Eigen::Quaterniond(poses[k].quaternion() *
                                   rotation_by(odometry[k].rotation.transpose() * rotation)),
                poses[k].translation};
  }
}

}  // namespace unimapper::merge
