// Plausibility gate for poses and stamps
#pragma once

#include <cstdint>

#include "unimapper/core/expected.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// Outcome of the check of a pose.
struct Motion {
  Error error;
  /// The odometry has jumped and stays where it is: earlier coordinates mean nothing any more.
  bool restarted = false;
};

/// Watches pose and time from scan to scan. A jump is refused once and stored: if the next
/// pose agrees with it the odometry was restarted, if it agrees with the one before it was a
/// glitch. So one wrong pose costs one scan, and a restart does not end the mapping.
/// Stamps likewise: one from far ahead costs one scan, a clock that is set ahead one, and a clock
/// that is set back two, since a single scan from the past may just be late.
class MotionGate {
 public:
  explicit MotionGate(const KeyframeConfig& config) noexcept
      : max_step_m_(static_cast<double>(config.max_pose_step_m)),
        max_speed_mps_(static_cast<double>(config.max_speed_mps)) {}

  /// Checks pose and stamp; stores them if they are a jump.
  Motion check(const Pose& pose, std::int64_t stamp_ns) noexcept;

  /// The scan that was checked last has become part of the map.
  void accept(const Pose& pose, std::int64_t stamp_ns) noexcept;

 private:
  struct Sample {
    bool known = false;
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    std::int64_t stamp_ns = 0;
  };

  Error check_time(const Pose& pose, std::int64_t stamp_ns) noexcept;
  void follow_clock(const Pose& pose, std::int64_t stamp_ns) noexcept;
  [[nodiscard]] bool reachable(const Sample& from, const Pose& pose,
                               std::int64_t stamp_ns) const noexcept;

  double max_step_m_;
  double max_speed_mps_;
  Sample last_;
  Sample jumped_;   ///< by its pose
  Sample shifted_;  ///< by its stamp
};

}  // namespace unimapper::onboard
