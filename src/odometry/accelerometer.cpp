#include "accelerometer.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "motion.hpp"
#include "src/core/cholesky.hpp"

namespace unimapper::odometry {
namespace {

constexpr double kGravity_m_s2 = 9.80665;
// Rotations of registered scans drift by so much in a second, as a random walk.
constexpr double kDrift_rad = 0.05 / 57.3;
constexpr double kWeakDrift_rad = 0.5 / 57.3;
// And the bias, with the temperature: 5 mg in 20 minutes.
constexpr double kBiasDrift_m_s2 = 0.05 / 34.6;

/// What makes a mean specific force one in m/s²; 0 where it is no such thing: an accelerometer that
/// is missing, or of another unit. A second's mean differs little from g while one drives.
double unit_of(double mean_force) noexcept {
  constexpr double kLeast = 0.8;
  constexpr double kMost = 1.25;
  if (mean_force > kLeast && mean_force < kMost) return kGravity_m_s2;  // Livox
  const double in_g = mean_force / kGravity_m_s2;
  return in_g > kLeast && in_g < kMost ? 1.0 : 0.0;
}

/// A mean in g of a robot that hardly accelerates. An IMU that takes gravity out gives such numbers
/// only by chance while one brakes.
bool is_surely_g(double mean_force) noexcept { return std::abs(mean_force - 1.0) < 0.05; }

}  // namespace

Eigen::Matrix3d levelling(const Eigen::Vector3d& up) noexcept {
  constexpr double kOnItsHead = -0.9;
  Eigen::Matrix3d first = Eigen::Matrix3d::Identity();
  if (up.z() < kOnItsHead) first.diagonal() << 1.0, -1.0, -1.0;
  const Eigen::Vector3d from = first * up;
  const Eigen::Matrix3d turn = skew(from.cross(Eigen::Vector3d::UnitZ()));
  return (Eigen::Matrix3d::Identity() + turn + turn * turn / (1.0 + from.z())) * first;
}

void Accelerometer::Sums::add(const Eigen::Vector3d& f, const Eigen::Matrix3d& R,
                              double w) noexcept {
  force += w * f;
  turn += w * R;
  weight += w;
}

Accelerometer::Sums Accelerometer::Sums::less(const Sums& other, double share) const noexcept {
  return {force - share * other.force, turn - share * other.turn, weight - share * other.weight};
}

Error Accelerometer::add(std::int64_t stamp_ns, const Eigen::Vector3d& m_s2) noexcept {
  constexpr double kMost_m_s2 = 200.0;  // 16 g, where the usual ones saturate, and more
  return samples_.add(stamp_ns, m_s2, kMost_m_s2, "the acceleration is not finite, or saturated");
}

Eigen::Matrix3d Accelerometer::begin(std::int64_t now_ns) noexcept {
  constexpr double kUnknown_m_s2 = 10.0;
  constexpr double kAcceleration_m_s2 = 1.5;  // of a robot that may drive already
  constexpr double kBias_m_s2 = 0.15;         // 15 mg: usual after calibration, and below 1 degree
  constexpr int kFewest = 5;
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int taken = 0;
  for (std::uint64_t i = samples_.first(); i < samples_.count(); ++i) {
    const ImuSamples::Sample& sample = samples_[i];
    if (sample.stamp_ns > now_ns || sample.stamp_ns < now_ns - kSecond_ns) continue;
    sum += sample.vector();
    ++taken;
  }
  const double mean = sum.norm() / std::max(1, taken);
  const bool is_in_m_s2 = unit_of(mean) == 1.0;
  const bool is_told = taken >= kFewest && (is_in_m_s2 || is_surely_g(mean));
  unit_ = !is_told ? 0.0 : is_in_m_s2 ? 1.0 : kGravity_m_s2;
  state_.setZero();
  state_.z() = kGravity_m_s2;
  const double unknown_m_s2 = is_told ? kAcceleration_m_s2 : kUnknown_m_s2;
  covariance_.setZero();
  covariance_.diagonal().head<3>().setConstant(unknown_m_s2 * unknown_m_s2);
  covariance_.diagonal().tail<3>().setConstant(kBias_m_s2 * kBias_m_s2);
  return is_told ? levelling(sum.normalized()) : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
}

void Accelerometer::widen(double variance_rad2) noexcept {
  // An error of a rotation turns g about itself.
  const Eigen::Matrix3d turn = skew(state_.head<3>());
  covariance_.topLeftCorner<3, 3>() += variance_rad2 * turn * turn.transpose();
}

void Accelerometer::open_window(const Pose& pose, std::int64_t stamp_ns) noexcept {
  knots_[has_left_ ? 1 : 0] = {pose.translation, stamp_ns};
  sums_ = {};
  moments_ = {};
  if (!has_left_) weak_.setZero();
  is_open_ = true;
}

void Accelerometer::lose(double seconds) noexcept {
  was_lost_ = true;
  is_open_ = false;
  has_left_ = false;
  constexpr double kLost_rad_s = 0.2;
  if (updates_ > 0) widen(kLost_rad_s * kLost_rad_s * seconds * seconds);
}

void Accelerometer::move(const Motion& motion) noexcept {
  constexpr double kWindow_s = 1.0;
  const double seconds = seconds_between(motion.before_ns, motion.now_ns);
  const double drift_rad = motion.is_rotation_weak ? kWeakDrift_rad : kDrift_rad;
  widen(drift_rad * drift_rad * seconds);
  covariance_.diagonal().tail<3>().array() += kBiasDrift_m_s2 * kBiasDrift_m_s2 * seconds;
  if (std::exchange(was_lost_, false)) return;
  if (!is_open_) open_window(motion.T_map_before, motion.before_ns);
  weak_ += motion.weak;
  const Velocity velocity =
      velocity_of(motion.T_map_before.inverse() * motion.T_map_now, std::max(seconds, 1e-9));
  const std::int64_t begin_ns = knots_[has_left_ ? 1 : 0].stamp_ns;
  std::int64_t last_ns = motion.before_ns;
  bool is_whole = true;
  next_ = std::max(next_, samples_.first());
  for (; next_ < samples_.count() && samples_[next_].stamp_ns <= motion.now_ns; ++next_) {
    const ImuSamples::Sample& sample = samples_[next_];
    if (sample.stamp_ns <= motion.before_ns) continue;
    const Eigen::Matrix3d R =
        motion.T_map_before.rotation *
        rotation_of(velocity.angular_rad_s * seconds_between(motion.before_ns, sample.stamp_ns));
    const Eigen::Vector3d force = R * sample.vector();
    const double step_s = seconds_between(last_ns, sample.stamp_ns);
    is_whole = is_whole && sample.stamp_ns - last_ns <= kLongestGap_ns;
    sums_.add(force, R, step_s);
    moments_.add(force, R, step_s * seconds_between(begin_ns, sample.stamp_ns));
    last_ns = sample.stamp_ns;
  }
  if (!is_whole || motion.now_ns - last_ns > kLongestGap_ns) {
    is_open_ = false;
    has_left_ = false;
  } else if (seconds_between(begin_ns, motion.now_ns) >= kWindow_s) {
    close_window(motion);
  }
}

/// Weights that rise to one over the first window, and fall to zero over the second: the mean of an
/// acceleration by them is a difference of velocities, which three places tell, however it changes.
void Accelerometer::close_window(const Motion& motion) noexcept {
  const double length_s = seconds_between(knots_[has_left_ ? 1 : 0].stamp_ns, motion.now_ns);
  if (!has_left_) {
    left_ = Sums{}.less(moments_, -1.0 / length_s);
    has_left_ = true;
    open_window(motion.T_map_now, motion.now_ns);
    return;
  }
  const Sums both = sums_.less(moments_, 1.0 / length_s).less(left_, -1.0);
  const double left_s = seconds_between(knots_[0].stamp_ns, knots_[1].stamp_ns);
  const Eigen::Vector3d slower = (knots_[1].place_m - knots_[0].place_m) / left_s;
  const Eigen::Vector3d faster = (motion.T_map_now.translation - knots_[1].place_m) / length_s;
  const double half_s = 0.5 * (left_s + length_s);
  update(both, (faster - slower) / half_s);
  has_left_ = false;
  open_window(motion.T_map_now, motion.now_ns);
}

/// Whether samples are in m/s² or in g, once that is known. Later windows do not change it.
bool Accelerometer::has_unit(double mean_force) noexcept {
  constexpr std::uint32_t kSurely = 5;
  const double unit = unit_of(mean_force);
  if (unit_ == 0.0) {
    in_g_ = is_surely_g(mean_force) ? in_g_ + 1 : 0;
    if (unit == 1.0 || in_g_ == kSurely) unit_ = unit;
  }
  return unit_ > 0.0 && unit == unit_;
}

void Accelerometer::update(const Sums& sums, const Eigen::Vector3d& acceleration_m_s2) noexcept {
  constexpr double kNoise_m_s2 = 0.1;    // of places, stamps, arms and vibration: 0.6 degrees
  constexpr double kBraking_m_s2 = 1.0;  // along an axis whose motion is predicted
  constexpr double kUnlikely = 9.0;      // three sigma: what is farther off weighs less
  if (!(sums.weight > 0.0)) return;
  const Eigen::Vector3d mean = sums.force / sums.weight;
  if (!has_unit(mean.norm())) {
    ++implausible_;
    return;
  }
  updates_in_g_ += unit_ == 1.0 ? 0 : 1;
  Eigen::Matrix<double, 3, 6> H;
  H << Eigen::Matrix3d::Identity(), sums.turn / sums.weight;
  const Eigen::Vector3d off = unit_ * mean - acceleration_m_s2 - H * state_;
  Eigen::Matrix3d noise = kNoise_m_s2 * kNoise_m_s2 * Eigen::Matrix3d::Identity();
  noise += kBraking_m_s2 * kBraking_m_s2 * weak_;
  const Eigen::Matrix3d known = H * covariance_ * H.transpose();
  const double unlikely =
      off.dot(Cholesky<3>(Eigen::Matrix3d(known + noise)).solve(off)) / kUnlikely;
  if (unlikely > 1.0) noise *= unlikely;
  constexpr double kForget = 0.2;
  misfit_ += kForget * (unlikely * kUnlikely / 3.0 - misfit_);
  const Eigen::Matrix3d inverse = Cholesky<3>(Eigen::Matrix3d(known + noise)).inverse();
  const Eigen::Matrix<double, 6, 3> gain = covariance_ * H.transpose() * inverse;
  state_ += gain * off;
  const Matrix6d keep = Matrix6d::Identity() - gain * H;
  covariance_ = Matrix6d(keep * covariance_ * keep.transpose() + gain * noise * gain.transpose());
  ++updates_;
}

double Accelerometer::sigma_rad() const noexcept {
  return sigma_of_fit_rad() * std::sqrt(std::max(1.0, misfit_));
}

double Accelerometer::sigma_of_fit_rad() const noexcept {
  const Eigen::Matrix3d P = covariance_.topLeftCorner<3, 3>();
  const double across = P.trace() - up().dot(P * up());
  return std::sqrt(std::max(0.0, 0.5 * across) / state_.head<3>().squaredNorm());
}

}  // namespace unimapper::odometry
