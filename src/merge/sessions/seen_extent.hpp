// Range that the keyframes of a session see
#pragma once

#include "unimapper/core/keyframe_record.hpp"

namespace unimapper::merge {

/// The distance from the sensor within which 95 % of a keyframe's static cells lie, metres; the
/// median over up to 64 keyframes, evenly spread. 0 if there are none with cells.
[[nodiscard]] double seen_extent_m(const SessionData& session);

}  // namespace unimapper::merge
