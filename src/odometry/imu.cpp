// Gyroscope and accelerometer between two scans.
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "tracker.hpp"

namespace unimapper::odometry {

std::int64_t Tracker::time_ns(double after_stamp_s) const noexcept {
  return stamp_ns + static_cast<std::int64_t>(after_stamp_s * 1e9);
}

/// Samples tell of so long a time before the scan, and no sum of times overflows.
bool Tracker::may_ask_imu(double seconds) const noexcept {
  constexpr std::int64_t kLatest_ns = 1LL << 62U;
  return stamp_ns <= kLatest_ns && stamp_ns >= -kLatest_ns && seconds <= kLongestPrediction_s;
}

/// What the gyroscope says of the time from the scan before to the last point of this one.
void Tracker::ask_gyroscope(double seconds) noexcept {
  turn_seen = false;
  turn_known = false;
  turns_known = false;
  if (!may_ask_imu(seconds)) return;
  turn_seen = gyroscope.rotation(time_ns(middle_s - seconds), time_ns(middle_s), turn);
  turn_known = turn_seen && !gyroscope.is_contradicted();
  statistics.scans_by_gyroscope += turn_known ? 1 : 0;
  statistics.scans_against_gyroscope += turn_seen && !turn_known ? 1 : 0;
  turns.first_s = 0.0F;
  turns.last_s = 0.0F;
  for (const ScanPoint& point : thinning.fine()) {
    const float after_s = point.time_s - static_cast<float>(middle_s);
    turns.first_s = std::min(turns.first_s, after_s);
    turns.last_s = std::max(turns.last_s, after_s);
  }
  turns_known = turn_known;
  for (int i = 0; i < SweepTurns::kCount && turns_known; ++i) {
    const double share = static_cast<double>(i) / (SweepTurns::kCount - 1);
    const double after_s = static_cast<double>(turns.first_s) +
                           share * static_cast<double>(turns.last_s - turns.first_s);
    turns_known = turn_in_sweep(after_s, turns.R_middle_then[i]);
  }
}

/// From the middle of the sweep; false where samples leave a gap.
bool Tracker::turn_in_sweep(double after_middle_s, Eigen::Matrix3d& R_middle_then) const noexcept {
  const std::int64_t middle_ns = time_ns(middle_s);
  const std::int64_t then_ns = time_ns(middle_s + after_middle_s);
  const bool is_known =
      gyroscope.rotation(std::min(then_ns, middle_ns), std::max(then_ns, middle_ns), R_middle_then);
  if (then_ns < middle_ns) R_middle_then = Eigen::Matrix3d(R_middle_then.transpose());
  return is_known;
}

void Tracker::ask_accelerometer(const Interval& interval) noexcept {
  if (!may_ask_imu(interval.seconds)) {
    accelerometer.lose(0.0);  // the pose is known, but no acceleration since the last one
    return;
  }
  Accelerometer::Motion motion{interval.T_odometry_before, time_ns(middle_s - interval.seconds),
                               T_odometry_middle, time_ns(middle_s)};
  for (std::uint32_t i = 0; i < result.weak.count; ++i) {
    const Eigen::Vector3d axis =
        result.T_odometry_sensor.rotation * result.weak.axes.block<3, 1>(0, static_cast<int>(i));
    motion.weak += axis * axis.transpose();
    motion.is_rotation_weak = motion.is_rotation_weak || axis.isZero();
  }
  accelerometer.move(motion);
  level(interval.seconds);
}

bool Tracker::is_up_known() const noexcept {
  return accelerometer.is_known() && !gyroscope.is_contradicted() && !statistics.imu_contradicted();
}

/// Takes back drift of roll and pitch: turns the odometry frame about the sensor, by what up has
/// moved beyond two sigma since it was first known. Less may be the accelerometer's error, and a
/// frame that was tilted from the start stays so: levelled later, the way would be bent.
void Tracker::level(double seconds) noexcept {
  constexpr double kSettles_s = 5.0;
  if (!is_up_known()) return;
  const Eigen::Vector3d up = T_odometry_map.rotation * accelerometer.up();
  const double sigma_rad = accelerometer.sigma_of_fit_rad();  // drift does not fit either
  if (!has_first_up) {
    has_first_up = true;
    first_up = up;
    first_up_sigma_rad = sigma_rad;
  }
  const double excess = (up - first_up).norm() - 2.0 * std::max(first_up_sigma_rad, sigma_rad);
  const Eigen::Vector3d axis = up.cross(first_up);
  if (!(excess > 0.0) || !(axis.norm() > 0.0)) return;
  const double back_rad = std::min(1.0, seconds / kSettles_s) * excess;
  const Eigen::Vector3d sensor_m = T_odometry_map * T_odometry_middle.translation;
  T_odometry_map.rotation =
      Eigen::Matrix3d(rotation_of(back_rad * axis.normalized()) * T_odometry_map.rotation);
  T_odometry_map.translation = sensor_m - T_odometry_map.rotation * T_odometry_middle.translation;
}

OdometryResult Tracker::levelled(const OdometryResult& in_map) const noexcept {
  OdometryResult seen = in_map;
  if (is_up_known()) {
    seen.up = T_odometry_map.rotation * accelerometer.up();
    seen.up_sigma_rad = accelerometer.sigma_rad();
  }
  seen.T_odometry_sensor = T_odometry_map * in_map.T_odometry_sensor;
  Matrix6d to_odometry = Matrix6d::Identity();
  to_odometry.topLeftCorner<3, 3>() = T_odometry_map.rotation;
  seen.covariance = to_odometry * in_map.covariance * to_odometry.transpose();
  return seen;
}

}  // namespace unimapper::odometry
