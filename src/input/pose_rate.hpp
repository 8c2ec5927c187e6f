// Poses that were interpolated between few given ones
#pragma once

#include "src/input/finding.hpp"
#include "src/input/stamps.hpp"

namespace unimapper::input {

/// What poses between straight stretches say of those that were given.
struct PoseRate {
  double interval_s = 0.0;  ///< median, between given poses; 0: poses were not interpolated
  /// By how much interpolated poses are off where the robot turns or changes its speed: nine of ten
  /// less, halfway between given ones.
  double off_deg = 0.0;
  double off_m = 0.0;
};

/// Looks for poses whose speed and turning rate change only every third scan or more rarely: those
/// between were interpolated. Scans of a robot that stands say nothing. O(scans).
[[nodiscard]] PoseRate measure_pose_rate(const Track& track);

/// Whether such poses are off by more than registration is.
[[nodiscard]] bool is_too_sparse(const PoseRate& rate);

/// Poses that are too sparse, as the cause of what the scans contradict: `other`, whose severity it
/// takes. Other causes are known only with more poses.
[[nodiscard]] Finding check_pose_rate(const PoseRate& rate, const Finding& other);

}  // namespace unimapper::input
