// Rotations that turn a direction that is known to be up to z.
#pragma once

#include <span>

#include "unimapper/core/keyframe.hpp"

namespace unimapper::merge {

/// A keyframe in the map, and how well its z axis is known to point up.
struct UpObservation {
  Eigen::Vector3d z_axis = Eigen::Vector3d::UnitZ();  ///< of the keyframe's frame, in the map
  KeyframeUp up;
};

/// The shortest rotation that turns `up`, of any length but zero, to z: a half turn about x where
/// it points down.
[[nodiscard]] Eigen::Matrix3d rotation_to_z(const Eigen::Vector3d& up);

/// The shortest rotation of the map that turns the mean of the known ups to z: the identity where
/// none is known. The central session's odometry frame, which the map's is, may be tilted.
[[nodiscard]] Eigen::Matrix3d levelling_rotation(std::span<const UpObservation> observations);

}  // namespace unimapper::merge
