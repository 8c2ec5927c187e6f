#include "gyroscope.hpp"

#include <algorithm>
#include <cmath>

#include "motion.hpp"

namespace unimapper::odometry {

Error Gyroscope::add(std::int64_t stamp_ns, const Eigen::Vector3d& rad_s) noexcept {
  constexpr double kFastest_rad_s = 34.0;  // 2000 deg/s: where the usual ones saturate
  return samples_.add(stamp_ns, rad_s, kFastest_rad_s,
                      "the angular velocity is not finite, or saturated");
}

bool Gyroscope::rotation(std::int64_t from_ns, std::int64_t to_ns,
                         Eigen::Matrix3d& turn) const noexcept {
  turn.setIdentity();
  const std::uint64_t count = samples_.count();
  const std::uint64_t first = samples_.first();
  if (count - first < 2 || to_ns < from_ns) return false;
  if (to_ns > samples_[count - 1].stamp_ns + kLongestGap_ns) return false;
  // The last one before the begin.
  std::uint64_t i = count;
  while (i > first && samples_[i - 1].stamp_ns > from_ns) --i;
  if (i == first) return false;
  std::int64_t now_ns = from_ns;
  for (--i; now_ns < to_ns; ++i) {
    const bool is_last = i + 1 == count;
    const ImuSamples::Sample& a = samples_[i];
    const ImuSamples::Sample& b = samples_[is_last ? i : i + 1];
    const std::int64_t end_ns = is_last ? to_ns : std::min(to_ns, b.stamp_ns);
    if ((is_last ? to_ns : b.stamp_ns) - a.stamp_ns > kLongestGap_ns) return false;
    const Eigen::Vector3d rad_s = 0.5 * (a.vector() + b.vector());
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
