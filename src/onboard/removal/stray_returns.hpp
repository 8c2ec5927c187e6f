// Stray returns of snow, rain and dust
#pragma once

#include <Eigen/Core>

#include "src/onboard/keyframe/cell_table.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::onboard {

/// Range up to which a cell that holds a single point of a keyframe is a stray return, metres: a
/// surface would leave eight in it. Of sensors whose pattern does not repeat, all scans together
/// do. 0 where the spacing of rays is not known, and where scans are thinned.
[[nodiscard]] float stray_range_m(const FreeSpaceConfig& measured, const KeyframeConfig& keyframe,
                                  float cell_m) noexcept;

/// Where a keyframe may hold stray returns.
struct StrayReturns {
  Eigen::Vector3f sensor_m = Eigen::Vector3f::Zero();  ///< from the grid's origin
  float range_m = 0.0F;                                ///< `stray_range_m`

  /// Whether the middle of a block is near enough. O(1).
  [[nodiscard]] bool may_be_in(const Block& block, float cell_m) const noexcept;
};

}  // namespace unimapper::onboard
