// Rotations and their vectors, without trigonometric functions
#pragma once

#include "unimapper/core/pose.hpp"

namespace unimapper {

/// The rotation by `angle_rad` (a rotation vector of at most a few turns). Series and products
/// alone: the same bits on every machine.
[[nodiscard]] Eigen::Matrix3d rotation_of(const Eigen::Vector3d& angle_rad) noexcept;

/// The rotation vector of a rotation, at most pi long. Series, products and roots alone.
[[nodiscard]] Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& rotation) noexcept;

}  // namespace unimapper
