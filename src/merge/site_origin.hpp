// Origin of the map frame in the site frame.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <span>

#include "unimapper/merge/known_position.hpp"

namespace unimapper::merge {

/// Points of a map are floats, which hold a millimetre up to some kilometres from the origin. So a
/// coordinate of 10 km or more is counted from the first position's, rounded to kilometres; the
/// first position stays the first as others are added.
[[nodiscard]] inline Eigen::Vector3d site_origin(std::span<const KnownPosition> positions) {
  constexpr double kFarM = 10000.0;
  constexpr double kStepM = 1000.0;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  bool has_horizontal = false;
  for (const KnownPosition& position : positions) {
    const auto round = [&](int axis) {
      const double value = position.position[axis];
      if (std::abs(value) >= kFarM) origin[axis] = kStepM * std::round(value / kStepM);
    };
    if (&position == &positions.front()) round(2);
    if (has_horizontal || !position.is_horizontal()) continue;
    has_horizontal = true;
    round(0);
    round(1);
  }
  return origin;
}

}  // namespace unimapper::merge
