// Place of a robot in the base's map as C's struct.
#pragma once

#include "ports/delivery/unimapper_delivery.h"
#include "ports/lcm/latest_map_pose.hpp"

namespace unimapper::delivery {

/// A place in the base's map for C, with its age by the steady clock of now.
[[nodiscard]] um_map_pose to_c(const lcm_port::HeardMapPose& heard,
                               const lcm_port::MapPoseCounters& counters);

}  // namespace unimapper::delivery
