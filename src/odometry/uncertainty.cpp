#include "uncertainty.hpp"

#include <algorithm>
#include <cmath>

#include "motion.hpp"
#include "src/core/cholesky.hpp"
#include "unimapper/core/keyframe.hpp"

namespace unimapper::odometry {
namespace {

/// What is not known of a velocity along a weak axis, and how it changes.
struct VelocityNoise {
  double unknown;       ///< deviation where no velocity is sure, per s
  double known;         ///< deviation of one that is, per s
  double acceleration;  ///< deviation, per s²
};
constexpr VelocityNoise kTranslation{20.0, 0.1, 1.0};  // m
constexpr VelocityNoise kRotation{0.5, 0.02, 0.1};     // rad

/// What no robot exceeds, nor a sensor carried by hand.
struct MostMotion {
  double acceleration;  ///< per s²
  double error;         ///< of registration and velocity
};
constexpr MostMotion kMostTranslation{20.0, 0.5};  // m
constexpr MostMotion kMostRotation{50.0, 0.1};     // rad

// By how much the velocity at the stamp differs from that of the scan: vehicles vibrate.
constexpr double kVibration_m_s = 0.1;
constexpr double kVibration_rad_s = 0.05;

/// Covariance of the pose by the equations.
Matrix6d covariance_of(const NormalEquations& equations) noexcept {
  // Points on one surface share its error: they are worth as many independent ones less.
  constexpr double kShared = 50.0;
  constexpr double kLeast_m2 = 0.01 * 0.01;
  const double variance_m2 = std::max(
      kLeast_m2, equations.weight > 0.0 ? equations.squares_m2 / equations.weight : kLeast_m2);
  return Cholesky<6>(equations.matrix).inverse() * (kShared * variance_m2);
}

}  // namespace

double WeakMotion::variance_after(double seconds, bool is_rotation) const noexcept {
  const VelocityNoise& noise = is_rotation ? kRotation : kTranslation;
  const double velocity = is_velocity_sure_ ? noise.known : noise.unknown;
  const double deviation = seconds * (velocity + 0.5 * noise.acceleration * seconds);
  return deviation * deviation;
}

double WeakMotion::variance_of(double open_s, double seconds, bool is_rotation) const noexcept {
  return variance_after(open_s, is_rotation) - variance_after(open_s - seconds, is_rotation);
}

Matrix6d WeakMotion::add(const Registered& found, double seconds, double ahead_s,
                         const Eigen::Matrix3d& R_sensor_odometry) noexcept {
  // An axis that is weak, or that nothing has determined yet, is so only by more points: a few that
  // are wrong must not end it.
  constexpr double kStillWeak = 0.006;
  constexpr double kSure = 0.01;
  determination_ = found.determination;
  sure_scans_ = determination_.share.minCoeff() > kSure ? sure_scans_ + 1 : 0;
  is_velocity_known_ = is_velocity_known_ || sure_scans_ > 0;
  is_velocity_sure_ = is_velocity_sure_ || sure_scans_ >= kTellFirstVelocity;
  Matrix6d covariance = covariance_of(found.equations);
  for (int kind = 0; kind < 2; ++kind) {
    OpenMotion& open = open_[kind];
    const double least = open.seconds > 0.0 || !is_velocity_known_ ? kStillWeak : kWeak;
    bool is_any_weak = false;
    for (int i = 3 * kind; i < 3 * kind + 3; ++i) {
      is_weak_[i] = !(determination_.share(i) > least);
      is_any_weak = is_any_weak || is_weak_[i];
    }
    if (!is_any_weak) {
      open.end_by_scan();
      continue;
    }
    const double variance = variance_of(open.go_on(seconds), seconds, kind == 1);
    for (int i = 3 * kind; i < 3 * kind + 3; ++i) {
      if (!is_weak_[i]) continue;
      const Eigen::Vector3d axis = determination_.axes.col(i);
      covariance.block<3, 3>(3 * kind, 3 * kind) += variance * axis * axis.transpose();
    }
  }
  is_lost_ = is_lost_ && open_[0].seconds > 0.0;  // a jump to the right place tells no velocity
  covariance.diagonal().head<3>().array() += kVibration_m_s * kVibration_m_s * ahead_s * ahead_s;
  covariance.diagonal().tail<3>().array() +=
      kVibration_rad_s * kVibration_rad_s * ahead_s * ahead_s;
  Matrix6d to_frames = Matrix6d::Identity();
  to_frames.bottomRightCorner<3, 3>() = R_sensor_odometry;
  return to_frames * covariance * to_frames.transpose();
}

bool WeakMotion::is_possible(const Pose& predicted, const Pose& found,
                             double seconds) const noexcept {
  constexpr double kSigmas = 3.0;
  if (!is_velocity_known_ && !is_lost_) return true;
  const Eigen::Vector3d off[2] = {found.translation - predicted.translation,
                                  rotation_vector(found.rotation * predicted.rotation.transpose())};
  for (int kind = 0; kind < 2; ++kind) {
    const MostMotion& most = kind == 0 ? kMostTranslation : kMostRotation;
    const double by_acceleration = most.error + most.acceleration * seconds * seconds;
    const double unknown =
        kSigmas * std::sqrt(variance_after(open_[kind].seconds + seconds, kind == 1));
    Eigen::Vector3d across = off[kind];  // the weak axes
    for (int i = 3 * kind; i < 3 * kind + 3; ++i) {
      const Eigen::Vector3d axis = determination_.axes.col(i);
      if (is_lost_ || is_weak_[i]) across -= axis.dot(across) * axis;
    }
    if (!(across.norm() <= by_acceleration)) return false;
    const bool is_open = across != off[kind];
    if (!(off[kind].norm() <= by_acceleration + (is_open ? unknown : 0.0))) return false;
  }
  return true;
}

Matrix6d WeakMotion::lose(double seconds) noexcept {
  is_velocity_known_ = false;
  is_velocity_sure_ = false;
  is_lost_ = true;
  sure_scans_ = 0;
  Matrix6d covariance = Matrix6d::Identity();
  for (int kind = 0; kind < 2; ++kind) {
    covariance.block<3, 3>(3 * kind, 3 * kind) *=
        variance_of(open_[kind].go_on(seconds), seconds, kind == 1);
  }
  return covariance;
}

WeakAxes WeakMotion::axes(const Eigen::Matrix3d& R_sensor_odometry) const noexcept {
  WeakAxes weak;
  for (int i = 0; i < 6; ++i) {
    if (!is_weak_[i]) continue;
    const Eigen::Vector3d axis = determination_.axes.col(i);
    weak.axes.block<3, 1>(i < 3 ? 0 : 3, static_cast<int>(weak.count++)) = R_sensor_odometry * axis;
  }
  return weak;
}

const char* reason_of(const WeakAxes& weak) noexcept {
  constexpr const char* kAlong[] = {"degenerate along the sensor's x axis or near it",
                                    "degenerate along the sensor's y axis or near it",
                                    "degenerate along the sensor's z axis or near it",
                                    "degenerate about the sensor's x axis or near it",
                                    "degenerate about the sensor's y axis or near it",
                                    "degenerate about the sensor's z axis or near it"};
  if (weak.count == 0) return "";
  if (weak.count > 1) return "degenerate along several axes";
  int longest = 0;
  for (int i = 1; i < 6; ++i) {
    if (std::abs(weak.axes(i, 0)) > std::abs(weak.axes(longest, 0))) longest = i;
  }
  return kAlong[longest];
}

}  // namespace unimapper::odometry

Eigen::Matrix3d unimapper::slip_of(const OdometryResult& result) noexcept {
  const Eigen::Matrix3d covariance = result.covariance.topLeftCorner<3, 3>();
  if (!result.error.ok()) return Eigen::Matrix3d::Zero();
  const bool is_lost = result.state == OdometryState::kLost;
  Eigen::Matrix3d slip = Eigen::Matrix3d::Zero();
  if (is_lost) slip = covariance;
  for (std::uint32_t i = 0; i < result.weak.count && !is_lost; ++i) {
    // Zero for an axis of rotation.
    const Eigen::Vector3d axis =
        result.T_odometry_sensor.rotation * result.weak.axes.block<3, 1>(0, static_cast<int>(i));
    slip += axis.dot(covariance * axis) * axis * axis.transpose();
  }
  // Half of what a slip may have at most, so that rounding and a rotation leave it one.
  const double most = 0.5 * static_cast<double>(kMostSlip_m2);
  return slip.maxCoeff() > most ? Eigen::Matrix3d(slip * (most / slip.maxCoeff())) : slip;
}
