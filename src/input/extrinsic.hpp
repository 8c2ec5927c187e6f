// Extrinsic calibration as a user states it.
#pragma once

#include <array>
#include <string>

#include "unimapper/core/pose.hpp"

namespace unimapper::input {

/// T_base_lidar of x, y, z (metres), roll, pitch, yaw (degrees), turned about the fixed axes x, y,
/// z in this order.
[[nodiscard]] Pose extrinsic_pose(const std::array<double, 6>& values);

/// Parses "x,y,z,roll,pitch,yaw" as `extrinsic_pose` takes them. Throws std::runtime_error naming
/// `option`.
[[nodiscard]] Pose parse_extrinsic(const std::string& text, const std::string& option);

/// "x,y,z,roll,pitch,yaw" as `parse_extrinsic` reads it.
[[nodiscard]] std::string extrinsic_text(const Pose& pose);

}  // namespace unimapper::input
