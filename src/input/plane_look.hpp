// A first look at two scans: points of one on planes of the other
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "src/onboard/calibration/direction_planes.hpp"
#include "src/onboard/calibration/pair_registration.hpp"

namespace unimapper::input {

/// Planes of scans by direction, as on the robot.
class PlaneLook {
 public:
  /// Points of a scan that it takes.
  static constexpr std::size_t kPoints = 6'144;

  PlaneLook();

  /// How points of `second`, a quarter of those given, lie on planes of `first`. About 0.2 ms.
  [[nodiscard]] onboard::PlaneFit fit(std::span<const Eigen::Vector3f> first,
                                      std::span<const Eigen::Vector3f> second,
                                      const Pose& T_first_second);

 private:
  std::vector<std::byte> memory_;
  onboard::DirectionPlanes planes_;
  std::vector<Eigen::Vector3f> looked_at_;
};

}  // namespace unimapper::input
