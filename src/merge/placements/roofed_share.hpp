// Share of the ground that has structure above it.
#pragma once

#include "unimapper/core/keyframe_record.hpp"

namespace unimapper::merge {

/// Of the columns of 2 m in which a keyframe observed ground within 30 m, the share in which it
/// observed static structure higher than the sensor too: near 1 below a ceiling, small outdoors. 0
/// without ground. O(cells).
[[nodiscard]] double roofed_share(const KeyframeRecord& keyframe);

}  // namespace unimapper::merge
