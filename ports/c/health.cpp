#include "ports/c/health.hpp"

#include <algorithm>

#include "ports/c/handle.hpp"

using namespace unimapper;
using namespace unimapper::c;

namespace unimapper::c {

void add_keyframe(um_health& health, const KeyframeStatistics& keyframe) noexcept {
  ++health.keyframes;
  health.points_in += keyframe.points_in;
  health.points_dynamic += keyframe.points_dynamic;
  health.deadline_misses += keyframe.deadline_missed ? 1 : 0;
  for (std::size_t i = 0; i < kDropCauses; ++i) health.dropped[i] += keyframe.dropped[i];
  for (std::size_t i = 0; i < kStages; ++i) {
    health.longest_stage_us[i] = std::max(health.longest_stage_us[i], keyframe.stage_us[i]);
  }
  for (std::size_t i = 0; i < kCapacities; ++i) {
    um_capacity& fullest = health.fullest[i];
    fullest.used = std::max(fullest.used, keyframe.capacity[i].used);
    fullest.capacity = keyframe.capacity[i].capacity;
  }
}

}  // namespace unimapper::c

extern "C" um_status um_health_get(um_pipeline* pipeline, um_health* health) {
  if (!is_pipeline(pipeline)) return UM_INVALID_HANDLE;
  if (health == nullptr) return refuse(*pipeline, UM_NULL_ARGUMENT);
  *health = pipeline->health;
  return tell(*pipeline, {});
}
