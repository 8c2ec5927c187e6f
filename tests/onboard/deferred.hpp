// Drives with deferred work
#pragma once

#include <algorithm>
#include <cstdint>

#include "integer_town.hpp"
#include "unimapper/onboard/owned_pipeline.hpp"

namespace unimapper::test {

/// Between two scans.
inline constexpr std::int64_t kPeriodNs = 100'000'000;

inline std::int64_t fake_ns = 0;
/// A clock that advances when it is read, so that every slice takes about the same.
inline std::int64_t fake_clock() { return fake_ns += 4000; }

/// Keyframes of so many scans, and so many of them in the window; little memory.
inline PipelineConfig short_keyframes(std::uint32_t scans, std::uint32_t window) {
  PipelineConfig config = preset(SensorKind::kHdl64e);
  config.keyframe.scans = scans;
  config.keyframe.max_points_per_scan = 40000;
  config.free_space.images_per_keyframe = std::min(2U, scans);
  config.removal.window = window;
  config.voxel.max_cells = 1U << 16U;
  config.voxel.max_window_blocks = 65536;
  config.voxel.max_voxels = 1U << 13U;
  config.loop_search.max_places = 12;
  config.search_scope.min_keyframe_gap = 3;
  return config;
}

}  // namespace unimapper::test
