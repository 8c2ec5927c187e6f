// Model of a surface in registration
#pragma once

namespace unimapper::merge {

/// Thickness of a surface, standard deviation, metres.
inline constexpr double kPlaneSigmaM = 0.03;

}  // namespace unimapper::merge
