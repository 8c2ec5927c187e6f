// Drives with deferred work
#pragma once

#include "integer_town.hpp"
#include "run.hpp"
#include "tests/test.hpp"

namespace unimapper::test {

inline std::int64_t fake_ns = 0;
/// A clock that advances when it is read, so that every slice takes about the same.
inline std::int64_t fake_clock() { return fake_ns += 4000; }

/// Keyframes of so many scans, and so many of them in the window.
inline PipelineConfig short_keyframes(std::uint32_t scans, std::uint32_t window) {
  PipelineConfig config = small_config();
  config.keyframe.scans = scans;
  config.free_space.images_per_keyframe = std::min(2U, scans);
  config.removal.window = window;
  config.voxel.max_window_blocks = 65536;
  config.loop_search.max_places = 12;
  config.search_scope.min_keyframe_gap = 3;
  return config;
}

}  // namespace unimapper::test
