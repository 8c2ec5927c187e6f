// A drive as loop search sees it: its keyframes, and where they really were.
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
  Pose T_odometry_keyframe;  ///< levelled frame, as the robot believed
  Pose T_world_keyframe;     ///< levelled frame, as it was; its own belief where no truth is known
  std::vector<FineCell> static_cells;
  std::vector<FineCell> dynamic_cells;
  std::vector<KeyframeScan> scans;
};

/// One run.
struct Drive {
  std::string sensor;
  std::vector<PlaceKeyframe> keyframes;
};

/// Reads the keyframes of a run folder that `unimapper onboard` wrote and places them by the
/// ground truth beside them: `gt_poses.txt`, one pose for every scan of the recording. The
/// recording itself is not needed. Throws std::runtime_error.
[[nodiscard]] Drive read_drive(const std::filesystem::path& run);

/// The same without truth: keyframes are where the robot believed them.
[[nodiscard]] Drive read_drive_without_truth(const std::filesystem::path& run);

/// The keyframes with their true poses, for `evaluate::score_loops`.
[[nodiscard]] std::vector<evaluate::TrueKeyframe> true_keyframes(const Drive& drive);

}  // namespace unimapper::bench
