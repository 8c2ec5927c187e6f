// Rotation that levels the map by what its keyframes know of up.
#pragma once

#include <span>

#include "unimapper/core/keyframe.hpp"

namespace unimapper::merge {

/// A keyframe in the map, and how well its z axis is known to point up.
struct UpObservation {
  Eigen::Vector3d z_axis = Eigen::Vector3d::UnitZ();  ///< of the keyframe's frame, in the map
  KeyframeUp up;
};

/// The shortest rotation of the map that turns the mean of the known ups to z: the identity where
/// none is known. The central session's odometry frame, which the map's is, may be tilted.
[[nodiscard]] Eigen::Matrix3d levelling_rotation(std::span<const UpObservation> observations);

}  // namespace unimapper::merge
