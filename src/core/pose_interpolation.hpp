// Interpolation between two poses.
#pragma once

#include "unimapper/core/pose.hpp"

namespace unimapper {

/// The pose at `share` of the way from `a` (0) to `b` (1): translation linear, rotation spherical
/// linear (slerp).
[[nodiscard]] inline Pose interpolate(const Pose& a, const Pose& b, double share) {
  return {a.quaternion().slerp(share, b.quaternion()),
          (1.0 - share) * a.translation + share * b.translation};
}

}  // namespace unimapper
