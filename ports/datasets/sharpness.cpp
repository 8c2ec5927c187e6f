#include "ports/datasets/sharpness.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace unimapper::datasets {

void SurfaceThickness::add(const Eigen::Vector3d& point) {
  constexpr std::int64_t kOffset = 1 << 20;
  const Eigen::Vector3d cell = (point / voxel_m_).array().floor();
  if (!(cell.array().abs() < static_cast<double>(kOffset)).all()) return;
  std::uint64_t key = 0;
  for (const double coordinate : {cell.x(), cell.y(), cell.z()}) {
    key = key << 21U | static_cast<std::uint64_t>(static_cast<std::int64_t>(coordinate) + kOffset);
  }
  Voxel& voxel = voxels_[key];
  const Eigen::Vector3d local = point - voxel_m_ * cell;
  voxel.sum += local;
  voxel.products += local * local.transpose();
  ++voxel.points;
  if (voxel.scans == 0 || voxel.last_scan != scan_) ++voxel.scans;
  voxel.last_scan = scan_;
}

double SurfaceThickness::log_thickness() const {
  constexpr std::uint32_t kLeastPoints = 12;
  constexpr std::uint32_t kLeastScans = 3;
  constexpr double kFloor_m2 = 0.005 * 0.005;
  double sum = 0.0;
  double weights = 0.0;
  for (const auto& [key, voxel] : voxels_) {
    if (voxel.points < kLeastPoints || voxel.scans < kLeastScans) continue;
    const double count = voxel.points;
    const Eigen::Vector3d mean = voxel.sum / count;
    const Eigen::Matrix3d covariance = voxel.products / count - mean * mean.transpose();
    const double smallest =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance, Eigen::EigenvaluesOnly)
            .eigenvalues()(0);
    sum += count * 0.5 * std::log(std::max(0.0, smallest) + kFloor_m2);
    weights += count;
  }
  return weights > 0.0 ? sum / weights : 0.0;
}

}  // namespace unimapper::datasets
