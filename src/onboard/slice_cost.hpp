// Expected cost of slices of deferred work
#pragma once

#include <algorithm>
#include <cstdint>

#include "src/onboard/keyframe/scan_accumulator.hpp"

/// Microseconds that slices take on a core of a server with AVX2: means over KITTI raw 0005 and
/// simulated towns of the OS2-128, VLP-16, Aeva, Avia and Mid-360, most within a half of them. They
/// decide how work is spread over calls, not what comes of it; only their ratios matter, and a
/// processor with other ratios has less even calls.
namespace unimapper::onboard::slice_cost {

inline constexpr std::uint32_t kMeasuring = 390;      ///< a scan, `SamplingMonitor::step`
inline constexpr std::uint32_t kBeginningScan = 250;  ///< aligning it
inline constexpr std::uint32_t kTable = 240;
inline constexpr std::uint32_t kMoments = 275;
inline constexpr std::uint32_t kPlanes = 140;
inline constexpr std::uint32_t kSplit = 90;
inline constexpr std::uint32_t kParts = 55;  ///< of components
inline constexpr std::uint32_t kSpreading = 120;
inline constexpr std::uint32_t kFollowing = 25;  ///< of low cells
inline constexpr std::uint32_t kTallies = 65;
inline constexpr std::uint32_t kMarking = 15;
inline constexpr std::uint32_t kClusters = 70;
inline constexpr std::uint32_t kOutput = 230;
inline constexpr std::uint32_t kLabels = 115;
inline constexpr std::uint32_t kDescription = 120;
inline constexpr std::uint32_t kSearch = 80;
inline constexpr std::uint32_t kInsertion = 190;
inline constexpr std::uint32_t kCalibration = 110;
inline constexpr std::uint32_t kBookkeeping = 5;

/// A shorter slice says nothing of how fast this processor is: what it takes is mostly chance.
inline constexpr std::uint32_t kLeastTimed = 100;

// Stages that are one slice, by the blocks of the keyframe.
[[nodiscard]] constexpr std::uint32_t arrangement(std::uint32_t blocks) noexcept {
  return blocks / 22;
}
[[nodiscard]] constexpr std::uint32_t ground(std::uint32_t blocks) noexcept { return blocks / 180; }
[[nodiscard]] constexpr std::uint32_t ground_levels(std::uint32_t blocks) noexcept {
  return blocks / 27;
}
[[nodiscard]] constexpr std::uint32_t occupancy(std::uint32_t blocks) noexcept {
  return blocks / 65;
}
[[nodiscard]] constexpr std::uint32_t record(std::uint32_t blocks) noexcept { return blocks / 52; }
[[nodiscard]] constexpr std::uint32_t decision(std::uint32_t blocks) noexcept {
  return 100 + blocks / 40;
}

/// Of projecting cells into images.
[[nodiscard]] constexpr std::uint32_t projections(std::uint32_t count) noexcept {
  return count / 400;
}
/// Of the evidence of some blocks.
[[nodiscard]] constexpr std::uint32_t evidence(std::uint32_t cells_in_images,
                                               std::uint32_t blocks) noexcept {
  return projections(cells_in_images) + blocks / 16;
}
/// Of samples of the ground that are projected.
[[nodiscard]] constexpr std::uint32_t transparent_ground(std::uint32_t blocks,
                                                         std::uint32_t samples_in_images) noexcept {
  return blocks / 60 + projections(samples_in_images);
}
/// Of counting the points of a keyframe.
[[nodiscard]] constexpr std::uint32_t counting(std::uint64_t points) noexcept {
  return static_cast<std::uint32_t>(points / 2048);
}
/// Of copying a scan that waits.
[[nodiscard]] constexpr std::uint32_t copying(std::uint64_t points) noexcept {
  return static_cast<std::uint32_t>(points / 384);
}
/// Of 1024 points of a scan that was added: 5.5 ns a point, 23 a run of points in one cell, 65 a
/// new block.
[[nodiscard]] constexpr std::uint32_t of_1024_points(const ScanCounts& counts,
                                                     std::uint32_t new_blocks) noexcept {
  const std::uint64_t half_ns =
      11 * counts.points + 46 * counts.runs + std::uint64_t{130} * new_blocks;
  return static_cast<std::uint32_t>(half_ns / 2 / std::max<std::uint64_t>(counts.points, 1));
}
/// Of so many points, if 1024 of them cost so much.
[[nodiscard]] constexpr std::uint32_t of_points(std::uint64_t points,
                                                std::uint32_t of_1024) noexcept {
  constexpr std::uint64_t kMost = 1U << 24U;
  return static_cast<std::uint32_t>(std::min(points, kMost) * of_1024 / 1024);
}

}  // namespace unimapper::onboard::slice_cost
