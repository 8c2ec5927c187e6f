// Covariance of odometry between two keyframes of a session.
#include "session_path.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <utility>

#include "src/core/cholesky.hpp"

namespace unimapper::merge {
namespace {

// Standard deviations of translation and rotation between any two keyframes, however near.
constexpr double kTranslationFloorM = 0.02;
constexpr double kRotationFloorRad = 0.001;

/// Without eigenvalues that are rounding beside the largest one, which may be negative: `is_slip`.
Eigen::Matrix3d semidefinite(const Eigen::Matrix3d& covariance) {
  constexpr double kRounding = 2e-4;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  const double least = kRounding * covariance.trace();
  const Eigen::Vector3d kept =
      (solver.eigenvalues().array() > least).select(solver.eigenvalues(), 0.0);
  return solver.eigenvectors() * kept.asDiagonal() * solver.eigenvectors().transpose();
}

}  // namespace

std::vector<double> path_lengths_m(const SessionData& session) {
  std::vector<double> path(session.keyframes.size(), 0.0);
  for (std::size_t k = 1; k < path.size(); ++k) {
    const Eigen::Vector3d step = session.keyframes[k].T_odometry_keyframe.translation -
                                 session.keyframes[k - 1].T_odometry_keyframe.translation;
    path[k] = path[k - 1] + step.norm();
  }
  return path;
}

SessionPath::SessionPath(std::vector<Pose> T_session_keyframe, const OdometryNoiseConfig& noise,
                         const std::vector<SlipCovariance>& slips)
    : poses_(std::move(T_session_keyframe)), noise_(noise) {
  path_.assign(poses_.size(), 0.0);
  for (std::size_t i = 1; i < poses_.size(); ++i) {
    path_[i] = path_[i - 1] + (poses_[i].translation - poses_[i - 1].translation).norm();
  }
  accumulate();
  if (std::all_of(slips.begin(), slips.end(), [](const auto& s) { return s.isZero(0.0F); })) return;
  slip_.assign(poses_.size(), Eigen::Matrix3d::Zero());
  for (std::size_t i = 1; i < poses_.size(); ++i) {
    slip_[i] = slip_[i - 1];
    if (i < slips.size()) slip_[i] += semidefinite(slips[i].cast<double>());
  }
}

SessionPath odometry_of(const SessionData& session, const OdometryNoiseConfig& noise) {
  std::vector<Pose> poses;
  std::vector<SlipCovariance> slips;
  for (const KeyframeRecord& keyframe : session.keyframes) {
    poses.push_back(keyframe.T_odometry_keyframe);
    slips.push_back(keyframe.slip);
  }
  return {std::move(poses), noise, slips};
}

SessionPath SessionPath::with_drift(double scale) const {
  SessionPath path = *this;
  path.noise_.translation_m_per_sqrt_m *= scale;
  path.noise_.rotation_rad_per_sqrt_m *= scale;
  return path;
}

SessionPath SessionPath::with_poses(std::vector<Pose> poses) const {
  SessionPath path = *this;
  path.poses_ = std::move(poses);
  // The way travelled stays what odometry measured; only levers follow the corrected poses.
  path.accumulate();
  return path;
}

void SessionPath::accumulate() {
  lever_first_.assign(poses_.size(), Eigen::Vector3d::Zero());
  lever_second_.assign(poses_.size(), 0.0);
  for (std::size_t i = 1; i < poses_.size(); ++i) {
    const double length = path_[i] - path_[i - 1];
    const Eigen::Vector3d middle = 0.5 * (poses_[i].translation + poses_[i - 1].translation);
    lever_first_[i] = lever_first_[i - 1] + length * middle;
    lever_second_[i] = lever_second_[i - 1] + length * middle.squaredNorm();
  }
}

RelativeVariance SessionPath::drift_variance(std::size_t i, std::size_t j) const {
  if (i == j) return {};
  const auto [first, last] = std::minmax(i, j);
  const double length = path_[last] - path_[first];
  const Eigen::Vector3d end = poses_[j].translation;
  const double lever = length * end.squaredNorm() -
                       2.0 * end.dot(lever_first_[last] - lever_first_[first]) +
                       lever_second_[last] - lever_second_[first];
  const double t = noise_.translation_m_per_sqrt_m;
  const double r = noise_.rotation_rad_per_sqrt_m;
  return {kTranslationFloorM * kTranslationFloorM + t * t * length + r * r * std::max(lever, 0.0),
          kRotationFloorRad * kRotationFloorRad + r * r * length};
}

Eigen::Matrix3d SessionPath::slip(std::size_t i, std::size_t j) const {
  if (slip_.empty() || i == j) return Eigen::Matrix3d::Zero();
  const auto [first, last] = std::minmax(i, j);
  return slip_[last] - slip_[first];
}

RelativeVariance SessionPath::variance(std::size_t i, std::size_t j) const {
  RelativeVariance v = drift_variance(i, j);
  // The trace is that of one axis, as a rule, and at most three times too large.
  v.translation += slip(i, j).trace();
  return v;
}

Eigen::Matrix3d SessionPath::translation_covariance(std::size_t i, std::size_t j) const {
  const Eigen::Matrix3d& R = poses_[i].rotation;
  Eigen::Matrix3d covariance = R.transpose() * slip(i, j) * R;
  covariance.diagonal().array() += drift_variance(i, j).translation;
  return covariance;
}

Matrix6d SessionPath::information(std::size_t i, std::size_t j) const {
  const RelativeVariance v = drift_variance(i, j);
  Matrix6d information = Matrix6d::Zero();
  information.topLeftCorner<3, 3>().diagonal().setConstant(1.0 / v.translation);
  if (!slip(i, j).isZero(0.0)) {
    information.topLeftCorner<3, 3>() = Cholesky<3>(translation_covariance(i, j)).inverse();
  }
  information.bottomRightCorner<3, 3>().diagonal().setConstant(1.0 / v.rotation);
  return information;
}

}  // namespace unimapper::merge
