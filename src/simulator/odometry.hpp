// Odometry error model: drift, random walk and jitter.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "geometry.hpp"
#include "simulate.hpp"

namespace unimapper::simulator {

/// Poses T_odometry_sensor for the true poses `T_town_sensor`. The odometry frame is gravity
/// aligned with its origin at the first sensor position and without the first pose's yaw.
std::vector<Frame> drifting_odometry(const std::vector<Frame>& T_town_sensor, DriftPreset preset,
                                     std::uint64_t key);

/// Expresses `poses` in the frame of the first one.
void start_at_identity(std::vector<Frame>& poses);

}  // namespace unimapper::simulator
