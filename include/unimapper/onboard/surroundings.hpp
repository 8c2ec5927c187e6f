// Indoors or outdoors, from the ranges of the first scans
#pragma once

#include <array>
#include <cstdint>

#include "unimapper/core/point_view.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper {

/// What the scans looked at so far say of the surroundings.
struct SurroundingsEstimate {
  Surroundings surroundings = Surroundings::kOutdoors;  ///< the decision
  /// The range that 99 % of a scan's points lie within, of the scan where it was largest, metres,
  /// up to 128.
  float extent_m = 0.0F;
  std::uint32_t scans = 0;     ///< looked at; scans with fewer than 1000 points are passed over
  bool sees_all_round = true;  ///< in every scan there were points in all directions
};

/// Decides between the two settings before a pipeline is created: indoors if in every one of the
/// scans 99 % of the points lie within 30 m and each eighth of the circle holds a hundredth of
/// them. So a LiDAR that does not see all round, and one scan that sees far, are enough for
/// outdoors. Needs no level sensor. No heap; the same result on every machine.
class SurroundingsEstimator {
 public:
  static constexpr std::uint32_t kScans = 10;      ///< what to look at: the first keyframe outdoors
  static constexpr float kIndoorsWithinM = 30.0F;  ///< the limit of `extent_m`

  /// Adds one scan in sensor coordinates. O(points).
  void add(const PointView& points) noexcept;

  /// The decision; outdoors before the first scan.
  [[nodiscard]] SurroundingsEstimate estimate() const noexcept;

 private:
  SurroundingsEstimate estimate_;
};

}  // namespace unimapper
