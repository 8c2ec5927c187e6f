// A place: what one keyframe looks like to loop search.
#pragma once

#include <span>

#include "unimapper/core/keyframe.hpp"

namespace unimapper {

/// The description of one keyframe in its levelled frame (paper section V-A). Triangles are not
/// part of it: they follow from the keypoints, bit-identically, wherever they are needed
/// (`build_triangles`), so only keypoints travel over the link.
struct PlaceView {
  std::span<const Keypoint> keypoints;
  std::span<const PlanePatch> planes;
};

}  // namespace unimapper
