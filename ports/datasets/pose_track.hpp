// Poses by time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "ports/datasets/poses.hpp"

namespace unimapper::datasets {

/// Between poses farther apart in time nothing is known of the motion.
inline constexpr std::int64_t kMaxPoseGap_ns = 500'000'000;

/// Poses of scans, found by their stamps.
struct TimedPoses {
  std::vector<std::optional<Pose>> poses;  ///< one a scan; empty where there is none
  std::int64_t farthest_ns = 0;            ///< from a scan's stamp to the nearest pose, at most
  std::size_t outside = 0;                 ///< scans before the first or after the last pose
  std::size_t in_gaps = 0;  ///< scans between poses farther apart than `kMaxPoseGap_ns`
  std::size_t copies = 0;   ///< poses that are there twice
  bool was_sorted = false;  ///< the file's order was another
};

/// The pose at each of `stamps_ns`, interpolated between its neighbours in `given` (read from
/// `file`). Poses in another order are sorted where that makes their way shorter. Throws
/// DatasetError where the trajectory has no poses or no stamps, where poses of one stamp differ,
/// where sorting makes the way longer, where they are those of two trajectories, or where fewer
/// than half of the scans get a pose.
[[nodiscard]] TimedPoses poses_at(const std::vector<std::int64_t>& stamps_ns,
                                  const Trajectory& given, const std::filesystem::path& file);

/// How often poses jump to another place and come back.
struct PoseAlternation {
  std::size_t jumps = 0;  ///< that no robot makes, and that one of the next two steps takes back
  std::size_t steps = 0;  ///< from pose to pose
  /// Whether they are those of two trajectories. One that jumps once, or has a few wrong poses, is
  /// one.
  [[nodiscard]] bool is_of_two() const { return jumps >= 5 && 20 * jumps >= steps; }
};

/// Counts the jumps to and fro of poses in the order of their stamps. O(n).
[[nodiscard]] PoseAlternation find_alternation(std::span<const std::int64_t> stamps_ns,
                                               std::span<const Pose> poses);

/// "alternate between two trajectories: 60 of 661 steps jump and come back".
[[nodiscard]] std::string alternation_text(const PoseAlternation& found);

/// How far apart poses with these stamps, in order, are: "poses are 1.0 s apart (...), at most 0.5
/// s are bridged".
[[nodiscard]] std::string poses_apart_text(std::span<const std::int64_t> stamps_ns);

/// What to do about it.
[[nodiscard]] std::string remedy_for_sparse_poses();

}  // namespace unimapper::datasets
