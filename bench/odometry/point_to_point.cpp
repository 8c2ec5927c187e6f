#include "bench/odometry/point_to_point.hpp"

#include <cmath>
#include <unordered_set>

#include "src/core/cholesky.hpp"

namespace unimapper::bench {
namespace {

constexpr double kMaxRange_m = 100.0;
constexpr double kVoxel_m = 1.0;

VoxelIndex voxel_of(const Eigen::Vector3d& p, double edge_m) {
  const Eigen::Vector3i index = (p / edge_m).array().floor().cast<int>();
  return {index.x(), index.y(), index.z()};
}

/// The first point of each voxel.
std::vector<Eigen::Vector3d> thinned(const std::vector<Eigen::Vector3d>& points, double edge_m) {
  std::unordered_set<VoxelKey> taken;
  std::vector<Eigen::Vector3d> result;
  for (const Eigen::Vector3d& p : points) {
    if (taken.insert(pack(voxel_of(p, edge_m))).second) result.push_back(p);
  }
  return result;
}

}  // namespace

std::vector<Eigen::Vector3d> PointToPoint::compensated(const PointView& points,
                                                       std::span<const float> time_s) const {
  Points result;
  for (std::size_t i = 0; i < points.count; ++i) {
    const Eigen::Vector3d p = points[i].cast<double>();
    if (!(p.norm() < kMaxRange_m) || p.isZero()) continue;
    const double after_s = time_s.empty() ? 0.0 : static_cast<double>(time_s[i]);
    result.push_back(odometry::moved(velocity_, after_s) * p);
  }
  return result;
}

const Eigen::Vector3d* PointToPoint::nearest(const Eigen::Vector3d& place_m, double reach_m) const {
  const VoxelIndex at = voxel_of(place_m, kVoxel_m);
  const Eigen::Vector3d* best = nullptr;
  double least_m2 = reach_m * reach_m;
  constexpr int kVoxels = 27;
  for (int k = 0; k < kVoxels; ++k) {
    const int i = (k + kVoxels / 2) % kVoxels;  // that of the point first: the others are far then
    const VoxelIndex index{at.x + i % 3 - 1, at.y + i / 3 % 3 - 1, at.z + i / 9 - 1};
    const Eigen::Array3d low_m = kVoxel_m * Eigen::Array3d(index.x, index.y, index.z);
    const Eigen::Array3d to_m =
        (low_m - place_m.array()).max(place_m.array() - low_m - kVoxel_m).max(0.0);
    if (to_m.matrix().squaredNorm() >= least_m2) continue;
    const auto voxel = map_.find(pack(index));
    if (voxel == map_.end()) continue;
    for (const Eigen::Vector3d& p : voxel->second) {
      const double distance_m2 = (p - place_m).squaredNorm();
      if (distance_m2 >= least_m2) continue;
      least_m2 = distance_m2;
      best = &p;
    }
  }
  return best;
}

Pose PointToPoint::registered(const Points& points, const Pose& predicted, double sigma_m) const {
  constexpr int kIterations = 500;
  constexpr double kSmallStep = 1e-4;
  const double kernel_m2 = sigma_m * sigma_m / 9.0;
  Pose pose = predicted;
  for (int i = 0; i < kIterations && !map_.empty(); ++i) {
    Eigen::Matrix<double, 6, 6> matrix = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix<double, 6, 1> right = Eigen::Matrix<double, 6, 1>::Zero();
    for (const Eigen::Vector3d& p : points) {
      const Eigen::Vector3d arm_m = pose.rotation * p;
      const Eigen::Vector3d* const target = nearest(arm_m + pose.translation, 3.0 * sigma_m);
      if (target == nullptr) continue;
      const Eigen::Vector3d off_m = arm_m + pose.translation - *target;
      const double root = kernel_m2 / (kernel_m2 + off_m.squaredNorm());
      Eigen::Matrix<double, 3, 6> derivative;
      derivative << Eigen::Matrix3d::Identity(), skew(-arm_m);
      matrix += root * root * derivative.transpose() * derivative;
      right -= root * root * derivative.transpose() * off_m;
    }
    const Eigen::Matrix<double, 6, 1> step = Cholesky<6>(matrix).solve(right);
    pose.translation += step.head<3>();
    pose.rotation = rotation_of(step.tail<3>()) * pose.rotation;
    if (step.norm() < kSmallStep) break;
  }
  return pose;
}

void PointToPoint::extend_map(const Points& points, const Pose& pose) {
  constexpr std::size_t kMostPoints = 20;
  const double apart_m2 = kVoxel_m * kVoxel_m / kMostPoints;
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector3d place_m = pose * p;
    Points& voxel = map_[pack(voxel_of(place_m, kVoxel_m))];
    bool is_new = voxel.size() < kMostPoints;
    for (const Eigen::Vector3d& other : voxel) {
      is_new = is_new && (other - place_m).squaredNorm() >= apart_m2;
    }
    if (is_new) voxel.push_back(place_m);
  }
  std::erase_if(map_, [&](const auto& voxel) {
    return (voxel.second.front() - pose.translation).norm() > kMaxRange_m;
  });
}

Pose PointToPoint::add_scan(double stamp_s, const PointView& points,
                            std::span<const float> time_s) {
  constexpr double kLeastDeviation_m = 0.1;
  const double seconds = map_.empty() ? 0.1 : stamp_s - stamp_s_;
  const Points frame = thinned(compensated(points, time_s), 0.5 * kVoxel_m);
  const Pose predicted = pose_ * odometry::moved(velocity_, seconds);
  const double sigma_m = std::sqrt(squared_deviations_m2_ / deviations_);
  const Pose pose = registered(thinned(frame, 1.5 * kVoxel_m), predicted, sigma_m);
  const Pose off = predicted.inverse() * pose;
  const double deviation_m =
      off.translation.norm() + 2.0 * kMaxRange_m * std::sin(0.5 * rotation_angle(off.rotation));
  if (!map_.empty() && deviation_m > kLeastDeviation_m) {
    squared_deviations_m2_ += deviation_m * deviation_m;
    ++deviations_;
  }
  if (!map_.empty()) velocity_ = odometry::velocity_of(pose_.inverse() * pose, seconds);
  extend_map(frame, pose);
  stamp_s_ = stamp_s;
  pose_ = pose;
  return pose;
}

}  // namespace unimapper::bench
