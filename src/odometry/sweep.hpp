// Poses of the sensor during a sweep.
#pragma once

#include <algorithm>

#include "gyroscope.hpp"
#include "motion.hpp"

namespace unimapper::odometry {

/// A sensor that moves at constant velocity while it sweeps. Poses refer to the middle of the scan:
/// what the velocity is wrong by then moves early and late points by as much, against each other.
class Sweep {
 public:
  /// `T_odometry_before` is the pose `interval_s` before `T_odometry_middle`. `points`: anything
  /// with `time_s`, seconds after the stamp, as is `middle_s`. `turns`: where a gyroscope knows how
  /// the sensor turned meanwhile; else null.
  template <typename Points>
  [[nodiscard]] static Sweep of(const Points& points, const Pose& T_odometry_before,
                                const Pose& T_odometry_middle, double interval_s,
                                double middle_s = 0.0, const SweepTurns* turns = nullptr) noexcept {
    Sweep sweep;
    sweep.poses_[0] = T_odometry_middle;
    float first = static_cast<float>(middle_s);
    float last = first;
    for (const auto& point : points) {
      first = std::min(first, point.time_s);
      last = std::max(last, point.time_s);
    }
    if (turns != nullptr) {
      first = static_cast<float>(middle_s) + turns->first_s;
      last = static_cast<float>(middle_s) + turns->last_s;
    }
    constexpr float kLeast_s = 1e-6F;  // of a sweep; steps of a shorter one may have no inverse
    if (!(last - first > kLeast_s)) return sweep;
    sweep.count_ = kPoses;
    sweep.first_s_ = first;
    sweep.steps_per_s_ = (kPoses - 1) / (last - first);
    const Velocity velocity =
        velocity_of(T_odometry_before.inverse() * T_odometry_middle, interval_s);
    for (int i = 0; i < kPoses; ++i) {
      const double time_s =
          static_cast<double>(first) + i / static_cast<double>(sweep.steps_per_s_) - middle_s;
      Pose way = moved(velocity, time_s);
      if (turns != nullptr) way.rotation = turns->R_middle_then[i];
      sweep.poses_[i] = T_odometry_middle * way;
    }
    return sweep;
  }

  /// Where a point is.
  struct Place {
    Eigen::Vector3d arm_m;    ///< from the sensor, odometry axes
    Eigen::Vector3d place_m;  ///< odometry frame
  };
  [[nodiscard]] Place place(const Eigen::Vector3d& point_m, float time_s) const noexcept {
    if (count_ == 1) {
      const Eigen::Vector3d arm_m = poses_[0].rotation * point_m;
      return {arm_m, arm_m + poses_[0].translation};
    }
    const float at = (time_s - first_s_) * steps_per_s_;
    const int i = std::clamp(static_cast<int>(at), 0, kPoses - 2);
    const double share = static_cast<double>(at) - i;
    const Pose& a = poses_[i];
    const Pose& b = poses_[i + 1];
    const Eigen::Vector3d arm_m =
        (1.0 - share) * (a.rotation * point_m) + share * (b.rotation * point_m);
    return {arm_m, arm_m + (1.0 - share) * a.translation + share * b.translation};
  }

 private:
  static constexpr int kPoses = SweepTurns::kCount;

  Pose poses_[kPoses];
  float first_s_ = 0.0F;
  float steps_per_s_ = 1.0F;
  int count_ = 1;
};

}  // namespace unimapper::odometry
