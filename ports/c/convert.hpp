// The core's results as C structs.
#pragma once

#include "ports/c/unimapper.h"
#include "unimapper/core/expected.hpp"
#include "unimapper/core/pose.hpp"
#include "unimapper/onboard/pipeline.hpp"

namespace unimapper::c {

[[nodiscard]] um_status to_c(ErrorCode code) noexcept;
[[nodiscard]] um_pose to_c(const Pose& pose) noexcept;
[[nodiscard]] Pose from_c(const um_pose& pose) noexcept;

/// Whether every byte of the view lies within the address space.
[[nodiscard]] bool is_possible(const um_points& points) noexcept;
[[nodiscard]] PointView to_view(const um_points& points) noexcept;

/// A keyframe as C sees it. `scans` and `loops` receive what C cannot read where they lie, the rest
/// is pointed to where it lies.
[[nodiscard]] um_keyframe to_c(const KeyframeView& view, um_scan* scans, um_loop* loops) noexcept;

}  // namespace unimapper::c
