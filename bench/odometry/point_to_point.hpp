// Odometry as kiss-icp 1.2 describes it, to compare with: points to points at constant velocity.
#pragma once

#include <Eigen/Core>
#include <span>
#include <unordered_map>
#include <vector>

#include "src/core/voxel_key.hpp"
#include "src/odometry/motion.hpp"
#include "unimapper/core/point_view.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::bench {

/// Its defaults: voxels of 1 m, 20 points in each, 100 m, an adaptive threshold from 2 m on.
class PointToPoint {
 public:
  /// T_odometry_sensor at the stamp of a scan. `time_s` as of `LidarOdometry::add_scan`.
  Pose add_scan(double stamp_s, const PointView& points, std::span<const float> time_s);

 private:
  using Points = std::vector<Eigen::Vector3d>;

  [[nodiscard]] Points compensated(const PointView& points, std::span<const float> time_s) const;
  [[nodiscard]] const Eigen::Vector3d* nearest(const Eigen::Vector3d& place_m,
                                               double reach_m) const;
  [[nodiscard]] Pose registered(const Points& points, const Pose& predicted, double sigma_m) const;
  void extend_map(const Points& points, const Pose& pose);

  std::unordered_map<VoxelKey, Points> map_;
  Pose pose_;
  odometry::Velocity velocity_;
  double stamp_s_ = 0.0;
  double squared_deviations_m2_ = 4.0;
  int deviations_ = 1;
};

}  // namespace unimapper::bench
