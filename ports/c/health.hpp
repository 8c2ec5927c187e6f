// Running totals of a pipeline for the C interface.
#pragma once

#include "ports/c/unimapper.h"
#include "unimapper/onboard/statistics.hpp"

namespace unimapper::c {

/// Adds a finished keyframe to the totals.
void add_keyframe(um_health& health, const KeyframeStatistics& keyframe) noexcept;

}  // namespace unimapper::c
