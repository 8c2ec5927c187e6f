// Prediction by odometry and correction by loops, to first order.
#include "localisation_filter.hpp"

#include <Eigen/Geometry>

#include "src/core/cholesky.hpp"
#include "src/merge/loops/loop_cycle.hpp"

namespace unimapper::merge {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;

/// Covariance of `first * second`, both uncertain.
Matrix6d product_covariance(const Pose& first, const Matrix6d& of_first, const Pose& second,
                            const Matrix6d& of_second) {
  Matrix6d by_first = Matrix6d::Identity();
  by_first.topRightCorner<3, 3>() = -first.rotation * skew(second.translation);
  by_first.bottomRightCorner<3, 3>() = second.rotation.transpose();
  Matrix6d by_second = Matrix6d::Identity();
  by_second.topLeftCorner<3, 3>() = first.rotation;
  return by_first * of_first * by_first.transpose() + by_second * of_second * by_second.transpose();
}

Vector6d difference(const Pose& from, const Pose& to) {
  const Eigen::AngleAxisd turn(from.rotation.transpose() * to.rotation);
  Vector6d d;
  d << to.translation - from.translation, turn.angle() * turn.axis();
  return d;
}

}  // namespace

UncertainPose pose_by_loop(const Pose& T_map_match, const LoopConstraint& loop) {
  return {
      T_map_match * loop.T_match_query,
      product_covariance(T_map_match, Matrix6d::Zero(), loop.T_match_query, loop_covariance(loop))};
}

double distance_chi2(const UncertainPose& a, const UncertainPose& b) {
  const Vector6d d = difference(a.pose, b.pose);
  return d.dot(Cholesky<6>(a.covariance + b.covariance).solve(d));
}

UncertainPose MapPoseFilter::predict(std::size_t k, const SessionPath& path) const {
  if (k == k_) return at_;
  const Pose step = path[k_].inverse() * path[k];
  return {at_.pose * step,
          product_covariance(at_.pose, at_.covariance, step, odometry_covariance(path, k_, k))};
}

void MapPoseFilter::correct(std::size_t k, const UncertainPose& measured, const SessionPath& path) {
  const UncertainPose before = predict(k, path);
  const Cholesky<6> sum(before.covariance + measured.covariance);
  if (!sum.valid()) return;
  const Matrix6d gain = before.covariance * sum.inverse();
  const Vector6d d = gain * difference(before.pose, measured.pose);
  UncertainPose after = before;
  after.pose.translation += d.head<3>();
  const double angle = d.tail<3>().norm();
  if (angle > 0.0) {
    const Eigen::Matrix3d turned =
        before.pose.rotation * Eigen::AngleAxisd(angle, d.tail<3>() / angle).toRotationMatrix();
    after.pose.rotation = Eigen::Quaterniond(turned).normalized().toRotationMatrix();
  }
  // Joseph's form stays positive definite.
  const Matrix6d rest = Matrix6d::Identity() - gain;
  after.covariance =
      rest * before.covariance * rest.transpose() + gain * measured.covariance * gain.transpose();
  start(k, after);
}

}  // namespace unimapper::merge
