// Keyframes of a drive with their true poses.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "unimapper/core/keyframe.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/evaluate/loops.hpp"

namespace unimapper::bench {

/// One keyframe of a run.
struct PlaceKeyframe {
  std::uint32_t sequence = 0;
  std::uint32_t scan = 0;    ///< index of its reference scan
  Pose T_odometry_keyframe;  ///< levelled frame, by odometry
  Pose T_world_keyframe;     ///< levelled frame, true; by odometry if there is no truth
  std::vector<FineCell> static_cells;
  std::vector<FineCell> dynamic_cells;
  std::vector<KeyframeScan> scans;
};

/// One run.
struct Drive {
  std::string sensor;
  std::vector<PlaceKeyframe> keyframes;
};

/// Reads the keyframes of a run folder that `unimapper onboard` wrote and sets their poses by the
/// ground truth beside them: `gt_poses.txt`, one pose for every scan of the recording. The
/// recording itself is not needed. Throws std::runtime_error.
[[nodiscard]] Drive read_drive(const std::filesystem::path& run);

/// The same without truth: keyframes have their odometry poses.
[[nodiscard]] Drive read_drive_without_truth(const std::filesystem::path& run);

/// The keyframes with their true poses, for `evaluate::score_loops`.
[[nodiscard]] std::vector<evaluate::TrueKeyframe> true_keyframes(const Drive& drive);

/// Frees the memory of all cells, which only descriptors are computed from.
void release_cells(Drive& drive);

}  // namespace unimapper::bench
