// Noise of given poses, from scan to scan
#pragma once

#include "src/core/calibration.hpp"
#include "src/input/stamps.hpp"

namespace unimapper::input {

/// Standard deviations of what differs from pose to pose at random, in the axes of the pose.
/// Measured by fourth differences: those of driving and swaying are small against those of noise.
/// Zero for fewer than five poses. At most 400 poses are looked at.
[[nodiscard]] Twist measure_pose_noise(const Track& track);

}  // namespace unimapper::input
