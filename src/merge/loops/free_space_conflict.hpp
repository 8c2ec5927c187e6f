// Structure of one keyframe in the free space of another.
#pragma once

#include <cstddef>

#include "src/merge/registration/keyframe_clouds.hpp"

namespace unimapper::merge {

/// What the range images of two keyframes say of each other's structure (no ground) within 25 m.
/// What lies behind a measured surface, or outside of the view, is not observed.
struct CommonView {
  /// Points, in the direction in which there are more.
  std::size_t observed = 0;
  /// Share of them that was seen through; the larger of both directions.
  double contradiction = 0.0;

  /// Whether enough points were observed for `contradiction` to mean something.
  [[nodiscard]] bool is_enough() const { return observed >= kFewestObserved; }
  /// A direction with fewer observed points contradicts nothing.
  static constexpr std::size_t kFewestObserved = 50;
};

/// O(points x images).
[[nodiscard]] CommonView common_view(const KeyframeClouds& clouds, KeyframeId match,
                                     KeyframeId query, const Pose& T_match_query);

}  // namespace unimapper::merge
