#include "gyroscope.hpp"

#include <algorithm>
#include <cmath>

#include "motion.hpp"

namespace unimapper::odometry {
Error Gyroscope::add(std::int64_t stamp_ns, const Eigen::Vector3d& rad_s) noexcept {
  constexpr double kFastest_rad_s = 34.0;          // 2000 deg/s: where the usual ones saturate
  constexpr std::int64_t kLatest_ns = 1LL << 62U;  // so that no difference overflows
  for (int axis = 0; axis < 3; ++axis) {
    if (!(std::abs(rad_s[axis]) < kFastest_rad_s)) {  // NaN, too
      return {ErrorCode::kInvalidPose, "the angular velocity is not finite, or saturated"};
    }
  }
  const bool is_later = count_ == 0 || stamp_ns > at(count_ - 1).stamp_ns;
  if (!is_later || stamp_ns >= kLatest_ns || stamp_ns <= -kLatest_ns) {
    return {ErrorCode::kTimeReversed, "the stamp is not later than that of the sample before"};
  }
  samples_[count_++ % kSamples] = {stamp_ns, {rad_s.x(), rad_s.y(), rad_s.z()}};
  return {};
}

bool Gyroscope::rotation(std::int64_t from_ns, std::int64_t to_ns,
                         Eigen::Matrix3d& turn) const noexcept {
  turn.setIdentity();
  const std::uint64_t kept = std::min(count_, kSamples);
  if (kept < 2 || to_ns < from_ns || to_ns > at(count_ - 1).stamp_ns + kLongestGap_ns) return false;
  // The last one before the begin.
  std::uint64_t i = count_;
  while (i > count_ - kept && at(i - 1).stamp_ns > from_ns) --i;
  if (i == count_ - kept) return false;
  std::int64_t now_ns = from_ns;
  for (--i; now_ns < to_ns; ++i) {
    const bool is_last = i + 1 == count_;
    const Sample& a = at(i);
    const Sample& b = at(is_last ? i : i + 1);
    const std::int64_t end_ns = is_last ? to_ns : std::min(to_ns, b.stamp_ns);
    if ((is_last ? to_ns : b.stamp_ns) - a.stamp_ns > kLongestGap_ns) return false;
    const Eigen::Vector3d rad_s(0.5 * (a.rad_s[0] + b.rad_s[0]), 0.5 * (a.rad_s[1] + b.rad_s[1]),
                                0.5 * (a.rad_s[2] + b.rad_s[2]));
    turn = turn * rotation_of((rad_s - bias_rad_s_) * seconds_between(now_ns, end_ns));
    now_ns = end_ns;
  }
  return true;
}

bool Gyroscope::is_contradicted() const noexcept {
  constexpr double kRegistered = 0.003 * 0.003;  // error of a scan's rotation, rad²
  return error_ > error_of_velocity_ + kRegistered;
}

void Gyroscope::learn(const Eigen::Matrix3d& registered, const Eigen::Matrix3d& by_samples,
                      const Eigen::Matrix3d& by_velocity, double seconds) noexcept {
  constexpr double kForget = 0.1;
  constexpr double kSlow_rad_s = 0.05;  // scale and axes of the gyroscope do not show
  constexpr double kLeastGain = 0.01;
  constexpr double kLargestBias_rad_s = 0.2;
  const Eigen::Vector3d off = rotation_vector(registered.transpose() * by_samples);
  const Eigen::Vector3d off_by_velocity = rotation_vector(registered.transpose() * by_velocity);
  error_ += kForget * (off.squaredNorm() - error_);
  error_of_velocity_ += kForget * (off_by_velocity.squaredNorm() - error_of_velocity_);
  if (rotation_vector(registered).norm() > kSlow_rad_s * seconds) return;
  const double gain = std::max(kLeastGain, 1.0 / ++slow_scans_);
  bias_rad_s_ += gain / seconds * off;
  bias_rad_s_ = bias_rad_s_.cwiseMax(-kLargestBias_rad_s).cwiseMin(kLargestBias_rad_s);
}

}  // namespace unimapper::odometry
