// Registration of a few points of a scan to planes of another one
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "direction_planes.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::onboard {

/// How points lie on planes under a motion.
struct PlaneFit {
  /// Share of the points that have a plane in their direction that lie on it: the mean over planes
  /// that face along x, y and z, so that ground does not hide that walls are off.
  float share = 0.0F;
  float least = 0.0F;  ///< points that say as much about a shift along the least known direction
  std::uint32_t points = 0;  ///< on planes
};

/// Takes points that have a plane in their direction under a motion, up to a third of `chosen` of
/// each of three directions of planes: a street has much ground and few walls across it. Returns
/// how many. 80 ns a point.
[[nodiscard]] std::uint32_t choose_points(const DirectionPlanes& planes,
                                          std::span<const Eigen::Vector3f> points,
                                          const Pose& T_first_second,
                                          std::span<Eigen::Vector3f> chosen) noexcept;

/// Point-to-plane registration by Gauss-Newton, one step at a time. The robust kernel narrows from
/// step to step.
class PairRegistration {
 public:
  static constexpr int kMostSteps = 10;

  void begin(const Pose& T_first_second) noexcept {
    pose_ = T_first_second;
    steps_ = 0;
    is_valid_ = true;
  }
  /// Another step; false once there is none left. 60 ns a point.
  bool step(const DirectionPlanes& planes, std::span<const Eigen::Vector3f> points) noexcept;
  [[nodiscard]] bool is_valid() const noexcept { return is_valid_; }
  /// T_first_second.
  [[nodiscard]] const Pose& pose() const noexcept { return pose_; }

 private:
  Pose pose_;
  int steps_ = 0;
  bool is_valid_ = false;
};

/// 40 ns a point.
[[nodiscard]] PlaneFit fit_of(const DirectionPlanes& planes,
                              std::span<const Eigen::Vector3f> points,
                              const Pose& T_first_second) noexcept;

}  // namespace unimapper::onboard
