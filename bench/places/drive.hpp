// Drives with the place descriptors of their keyframes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "bench/places/std_baseline.hpp"
#include "unimapper/core/keyframe.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::bench {

/// Processor time of the calling thread: other load does not count.
[[nodiscard]] double thread_milliseconds();

/// One keyframe of a run, and its descriptor.
struct PlaceKeyframe {
  std::uint32_t sequence = 0;
  std::uint32_t scan = 0;    ///< index of its reference scan
  Pose T_odometry_keyframe;  ///< levelled frame, by odometry
  Pose T_world_keyframe;     ///< levelled frame, true
  std::vector<KeyframeScan> scans;
  std::vector<Keypoint> keypoints;
  std::vector<PlanePatch> planes;
  double describe_ms = 0.0;

  [[nodiscard]] PlaceView place() const { return {keypoints, planes}; }
};

/// One run.
struct Drive {
  std::string sensor;
  std::string route;
  std::vector<PlaceKeyframe> keyframes;
  std::vector<StdPlace> std_places;  ///< of every keyframe, in the odometry frame; or none
};

/// Reads a run folder SENSOR-ROUTE that `unimapper onboard` wrote, describes its keyframes by the
/// default, and sets their true poses by `gt_poses.txt` beside them, one pose for every scan of the
/// recording. STD's descriptors are read where `describe_std` wrote them. Throws
/// std::runtime_error.
[[nodiscard]] Drive read_drive(const std::filesystem::path& run);

/// Writes STD's descriptors of a run into RUN/std.places: like STD itself from the raw scans, in
/// the odometry frame. Throws std::runtime_error.
void describe_std(const std::filesystem::path& run, const std::filesystem::path& recording);

}  // namespace unimapper::bench
