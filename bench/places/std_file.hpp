// File of a drive's STD descriptors, so that the scans need not be kept.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "bench/places/std_baseline.hpp"

namespace unimapper::bench {

/// One keyframe's description.
struct StdKeyframe {
  std::uint32_t sequence = 0;
  double milliseconds = 0.0;  ///< of one thread's processor time
  StdPlace place;             ///< in the odometry frame
};

/// Doubles as they lie in memory: read on the machine that wrote it. Throws std::runtime_error.
void write_std_file(const std::filesystem::path& file, const std::vector<StdKeyframe>& keyframes);

/// Throws std::runtime_error if it is no such file, or not all of it.
[[nodiscard]] std::vector<StdKeyframe> read_std_file(const std::filesystem::path& file);

}  // namespace unimapper::bench
