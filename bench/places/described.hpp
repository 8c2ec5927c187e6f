// Drives described: what loop search is fed with.
#pragma once

#include <vector>

#include "bench/places/drive.hpp"
#include "unimapper/core/keyframe.hpp"
#include "unimapper/place/config.hpp"

namespace unimapper::bench {

/// What an ablation changes besides parameters.
struct DescriptionVariant {
  bool with_dynamic = false;  ///< what removal took out is put back
  bool world_frame = false;   ///< described on a grid of the odometry frame, as STD does
};

/// A keyframe's description, owned.
struct OwnedPlace {
  std::vector<Keypoint> keypoints;
  std::vector<PlanePatch> planes;
  /// From the frame of the description to the keyframe's levelled frame.
  Pose T_keyframe_place;
  double milliseconds = 0.0;  ///< of one thread's processor time

  [[nodiscard]] PlaceView view() const { return {keypoints, planes}; }
};

/// Describes every keyframe of a drive.
[[nodiscard]] std::vector<OwnedPlace> describe(const Drive& drive, const DescriptorConfig& config,
                                               const DescriptionVariant& variant = {});

}  // namespace unimapper::bench
