#include "direction_planes.hpp"

#include <algorithm>
#include <cmath>

#include "src/core/symmetric_eigen.hpp"

namespace unimapper::onboard {

void DirectionPlanes::allocate(Arena& arena) noexcept {
  index_ = arena.allocate<std::uint16_t>(kSquares);
  cells_ = arena.allocate<Cell>(kCells);
}

void DirectionPlanes::clear() noexcept {
  constexpr float kWanted = 12.0F;
  constexpr std::uint32_t kFewest = 500;
  if (points_ >= kFewest) {
    const float each = static_cast<float>(points_) / static_cast<float>(size_);
    const float edge = static_cast<float>(edge_) * std::sqrt(each / kWanted) + 0.5F;
    edge_ = std::clamp(static_cast<std::uint32_t>(edge), kFewestEdge, kMostEdge);
  }
  std::fill_n(index_, kSquares, std::uint16_t{0});
  points_ = 0;
  size_ = 0;
  planes_ = 0;
}

std::uint32_t DirectionPlanes::square_of(const Eigen::Vector3f& p) const noexcept {
  const float x = std::fabs(p.x());
  const float y = std::fabs(p.y());
  const float z = std::fabs(p.z());
  std::uint32_t face = 0;
  float along = p.x();
  float u = p.y();
  float v = p.z();
  if (y > x && y >= z) {
    face = 2;
    along = p.y();
    u = p.x();
  } else if (z > x && z > y) {
    face = 4;
    along = p.z();
    u = p.x();
    v = p.y();
  }
  if (along < 0.0F) ++face;
  const float half = 0.5F * static_cast<float>(edge_);
  const float scale = half / std::fabs(along);
  const auto square = [this](float at) noexcept {
    // In this order NaN, of a point that a motion takes to the sensor, is 0.
    return std::min(static_cast<std::uint32_t>(std::max(0.0F, at)), edge_ - 1);
  };
  return (face * edge_ + square(half + scale * v)) * edge_ + square(half + scale * u);
}

void DirectionPlanes::add(const Eigen::Vector3f& point_m) noexcept {
  ++points_;
  std::uint16_t& entry = index_[square_of(point_m)];
  if (entry == 0) {
    if (size_ == kCells) return;
    cells_[size_].sums = {point_m, Eigen::Vector3f::Zero(), {}, 0};
    entry = static_cast<std::uint16_t>(++size_);
  }
  Sums& sums = cells_[entry - 1U].sums;
  const Eigen::Vector3f p = point_m - sums.first_m;
  sums.sum_m += p;
  sums.products_m2[0] += p.x() * p.x();
  sums.products_m2[1] += p.x() * p.y();
  sums.products_m2[2] += p.x() * p.z();
  sums.products_m2[3] += p.y() * p.y();
  sums.products_m2[4] += p.y() * p.z();
  sums.products_m2[5] += p.z() * p.z();
  ++sums.points;
}

void DirectionPlanes::fit() noexcept {
  planes_ = 0;
  for (std::uint32_t i = 0; i < size_; ++i) {
    cells_[i].plane = fit(cells_[i].sums);
    planes_ += cells_[i].plane.reach_m2 > 0.0F ? 1 : 0;
  }
}

DirectionPlane DirectionPlanes::fit(const Sums& sums) noexcept {
  constexpr std::uint32_t kFewest = 6;
  constexpr float kThick_m2 = 0.04F * 0.04F;
  constexpr float kFlat = 0.01F;  // of the middle eigenvalue
  constexpr float kReach = 9.0F;
  DirectionPlane plane;
  if (sums.points < kFewest) return plane;
  const float per_point = 1.0F / static_cast<float>(sums.points);
  const Eigen::Vector3f mean = per_point * sums.sum_m;
  const float* const s = sums.products_m2;
  Eigen::Matrix3f covariance;
  covariance << s[0], s[1], s[2], s[1], s[3], s[4], s[2], s[4], s[5];
  covariance = per_point * covariance - mean * mean.transpose();
  const SymmetricEigen<float> eigen = symmetric_eigen(covariance);
  // A line of points has no normal, and what is thick is no plane.
  const float thickness = std::max(eigen.values.x(), 0.0F);
  if (thickness > kThick_m2 || eigen.values.y() < 0.0025F ||
      thickness > kFlat * eigen.values.y() + 1e-4F || thickness > 0.1F * eigen.values.y()) {
    return plane;
  }
  plane.mean_m = sums.first_m + mean;
  plane.normal = eigen.vectors.col(0);
  plane.reach_m2 = kReach * (eigen.values.y() + eigen.values.z());
  return plane;
}

const DirectionPlane* DirectionPlanes::find(const Eigen::Vector3f& point_m) const noexcept {
  const std::uint16_t entry = index_[square_of(point_m)];
  if (entry == 0) return nullptr;
  const DirectionPlane& plane = cells_[entry - 1U].plane;
  return plane.reach_m2 > 0.0F ? &plane : nullptr;
}

}  // namespace unimapper::onboard
