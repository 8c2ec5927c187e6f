// Thickness of the surfaces in several scans together.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <unordered_map>

namespace unimapper::datasets {

/// Gathers points of several scans in voxels and measures how thick the surfaces in them are.
class SurfaceThickness {
 public:
  explicit SurfaceThickness(double voxel_m = 0.5) : voxel_m_(voxel_m) {}

  /// Adds a point of the scan that was announced last, in a frame common to all scans. Points that
  /// are not finite or lie 2^20 voxels and more from the origin are left out.
  void add(const Eigen::Vector3d& point);
  /// The points from now on are of another scan.
  void begin_scan() { ++scan_; }
  /// Mean over all points in voxels with at least 12 points of at least three scans: half the
  /// logarithm of the smallest eigenvalue of the voxel's covariance, plus (5 mm)^2. One less: the
  /// surfaces are e times thinner. Zero without such voxels. O(voxels).
  [[nodiscard]] double log_thickness() const;

 private:
  struct Voxel {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
    std::uint32_t points = 0;
    std::uint32_t scans = 0;
    std::uint32_t last_scan = 0;
  };

  double voxel_m_;
  std::uint32_t scan_ = 0;
  std::unordered_map<std::uint64_t, Voxel> voxels_;
};

}  // namespace unimapper::datasets
