// Extrinsic calibration as a command-line argument.
#pragma once

#include <string>

#include "unimapper/core/pose.hpp"

namespace unimapper::apps {

/// Parses "x,y,z,roll,pitch,yaw" (metres, degrees; rotations about the fixed axes x, y, z in this
/// order) as T_base_lidar. Throws std::runtime_error naming `option`.
[[nodiscard]] Pose parse_extrinsic(const std::string& text, const std::string& option);

}  // namespace unimapper::apps
