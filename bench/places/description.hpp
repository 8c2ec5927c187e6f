// Place descriptors of every keyframe of a drive.
#pragma once

#include <vector>

#include "bench/places/drive.hpp"
#include "unimapper/core/keyframe.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::bench {

/// Changes of an ablation besides parameters.
struct DescriptionVariant {
  bool with_dynamic = false;  ///< dynamic cells are described, too
  bool world_frame = false;   ///< described on a grid of the odometry frame, as STD does
};

/// Descriptor of a keyframe, with its own memory.
struct OwnedPlace {
  std::vector<Keypoint> keypoints;
  std::vector<PlanePatch> planes;
  /// From the frame of the description to the keyframe's levelled frame.
  Pose T_keyframe_place;
  double milliseconds = 0.0;  ///< of one thread's processor time

  [[nodiscard]] PlaceView view() const { return {keypoints, planes}; }
};

/// Describes every keyframe of a drive.
[[nodiscard]] std::vector<OwnedPlace> describe(const Drive& drive, const PipelineConfig& config,
                                               const DescriptionVariant& variant = {});

}  // namespace unimapper::bench
