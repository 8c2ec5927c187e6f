// Scales of the intensities of sessions.
#pragma once

#include <vector>

#include "session_voxels.hpp"

namespace unimapper::merge {

/// By session, what its intensities are multiplied by so that those of voxels that several saw
/// agree: 1, or above 1 where the scale of another is twice as high or more. Null sessions, and
/// those that share too few voxels, have 1. O(voxels); one tile is in memory.
[[nodiscard]] std::vector<float> intensity_factors(
    const std::vector<const SessionVoxels*>& sessions);

}  // namespace unimapper::merge
