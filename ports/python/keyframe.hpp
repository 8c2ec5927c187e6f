// Keyframes and places as Python holds them: copies of what the pipeline overwrites.
#pragma once

#include <vector>

#include "unimapper/core/keyframe.hpp"
#include "unimapper/onboard/pipeline.hpp"

namespace unimapper::python {

/// A description of a place.
struct Place {
  std::vector<Keypoint> keypoints;  ///< levelled keyframe frame
  std::vector<PlanePatch> planes;   ///< levelled keyframe frame
  KeyframeUp up;                    ///< how level the frame is

  Place() = default;
  explicit Place(const PlaceView& view)
      : keypoints(view.keypoints.begin(), view.keypoints.end()),
        planes(view.planes.begin(), view.planes.end()),
        up(view.up) {}
  /// It points into this place.
  [[nodiscard]] PlaceView view() const { return {keypoints, planes, up}; }
};

/// A keyframe of a pipeline, without its free-space images.
struct Keyframe {
  KeyframeView content;  ///< its spans are empty
  KeyframeStatistics statistics;
  std::vector<KeyframeScan> scans;
  std::vector<FineCell> static_cells;
  std::vector<FineCell> dynamic_cells;
  std::vector<LoopCandidate> loops;
  Place place;

  explicit Keyframe(const KeyframeView& view);
};

}  // namespace unimapper::python
