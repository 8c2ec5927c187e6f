// Noise of given poses, from scan to scan
#pragma once

#include <Eigen/Core>
#include <vector>

#include "src/input/stamps.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::input {

/// Rotation vector (rad) and shift (m).
using Twist = Eigen::Matrix<double, 6, 1>;

/// Axis of a rotation, as long as its angle in rad.
[[nodiscard]] Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& r);

/// Median of magnitudes as the standard deviation of normal errors.
[[nodiscard]] double scale_of(std::vector<double> magnitudes);

/// Standard deviations of what differs from pose to pose at random, in the axes of the pose.
/// Measured by fourth differences: those of driving and swaying are small against those of noise.
/// Zero for fewer than five poses. At most 400 poses are looked at.
[[nodiscard]] Twist measure_pose_noise(const Track& track);

/// The larger one of roll and pitch in such noise, degrees.
[[nodiscard]] double attitude_noise_deg(const Twist& noise);

}  // namespace unimapper::input
