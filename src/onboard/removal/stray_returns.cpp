#include "stray_returns.hpp"

#include <cmath>

#include "unimapper/core/pose.hpp"

namespace unimapper::onboard {

float stray_range_m(const FreeSpaceConfig& measured, const KeyframeConfig& keyframe,
                    float cell_m) noexcept {
  constexpr float kReturns = 8.0F;
  if (keyframe.downsample_leaf_m > 0.0F) return 0.0F;
  // A cell's edge, as seen from one metre away.
  const float cell_deg = cell_m * static_cast<float>(kDegreesPerRadian);
  float area_deg2 = measured.ray_spacing_deg * measured.ring_spacing_deg;
  if (!(area_deg2 > 0.0F)) {
    if (!(measured.full_weight_range_m > 0.0F)) return 0.0F;
    // There neighbouring rays of all scans are two cells apart.
    const float spacing_deg = 2.0F * cell_deg / measured.full_weight_range_m;
    area_deg2 = spacing_deg * spacing_deg;
  }
  return cell_deg / std::sqrt(kReturns * area_deg2);
}

bool StrayReturns::may_be_in(const Block& block, float cell_m) const noexcept {
  const float edge_m = cell_m * static_cast<float>(Block::kEdge);
  const Eigen::Vector3f middle_m = Eigen::Vector3f(static_cast<float>(block.index.x) + 0.5F,
                                                   static_cast<float>(block.index.y) + 0.5F,
                                                   static_cast<float>(block.index.z) + 0.5F) *
                                   edge_m;
  return (middle_m - sensor_m).squaredNorm() < range_m * range_m;
}

}  // namespace unimapper::onboard
