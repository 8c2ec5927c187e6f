// Distances at which overlap of structure is measured, before and after registration.
#pragma once

namespace unimapper::merge {

inline constexpr double kOverlapRadiusM =
    30.0;  ///< structure farther from either origin is left out
inline constexpr double kCoarseDistanceM = 1.5;  ///< of coinciding points, before registration
inline constexpr double kFineDistanceM = 0.5;    ///< of coinciding points, after registration

}  // namespace unimapper::merge
