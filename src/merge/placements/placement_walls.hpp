// Distance of walls between two sessions, beside that within each.
#pragma once

#include <limits>

#include "src/merge/registration/keyframe_clouds.hpp"
#include "unimapper/merge/alignment.hpp"

namespace unimapper::merge {

/// How far nine in ten points of walls lie from those of another keyframe, metres: the median over
/// pairs of keyframes. NaN where too few share walls.
struct PlacementWalls {
  double between_m = std::numeric_limits<double>::quiet_NaN();  ///< at the loops
  /// Of the same keyframes and those before them, as far away as the loops' are: the larger of both
  /// sessions.
  double within_m = std::numeric_limits<double>::quiet_NaN();
};

/// At up to sixteen of the placement's loops, evenly spread.
[[nodiscard]] PlacementWalls compare_walls(const Placement& placement, const KeyframeClouds& clouds,
                                           unsigned threads);

}  // namespace unimapper::merge
