#include "ports/delivery/c_health.hpp"

#include <string>

#include "ports/c/unimapper.h"
#include "unimapper/onboard/statistics.hpp"

namespace unimapper::delivery {

wire::HealthMessage to_message(const um_health& health) {
  wire::HealthMessage message;
  message.scans = health.scans;
  message.keyframes = health.keyframes;
  message.points_in = health.points_in;
  message.deadline_misses = health.deadline_misses;
  for (std::size_t i = 0; i < kStages; ++i) {
    const auto stage = static_cast<Stage>(i);
    message.stages.push_back(
        {std::string(stage_name(stage)), 0.0F, 0.0F, health.longest_stage_us[i] * 1e-3F});
  }
  for (std::size_t i = 0; i < kDropCauses; ++i) {
    const auto cause = static_cast<DropCause>(i);
    message.drops.push_back({std::string(drop_cause_name(cause)), health.dropped[i]});
  }
  for (std::size_t i = 0; i < kCapacities; ++i) {
    const auto capacity = static_cast<Capacity>(i);
    const um_capacity& fullest = health.fullest[i];
    message.containers.push_back(
        {std::string(capacity_name(capacity)), fullest.used, fullest.capacity});
  }
  return message;
}

}  // namespace unimapper::delivery
