// Thinned clouds with surface covariances and a kd-tree.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>

#include "point_tree.hpp"
#include "registration.hpp"
#include "src/core/symmetric_eigen.hpp"
#include "src/core/voxel_key.hpp"
#include "src/merge/voxel_table.hpp"
#include "surface_model.hpp"

namespace unimapper::merge {
namespace {

/// Covariance with the eigenvectors of the local scatter and standard eigenvalues: small across a
/// surface, small in both directions across a pole, large along both, and isotropic for foliage.
Eigen::Matrix3f regularised(const Eigen::Matrix3f& scatter) {
  constexpr float kAlong = 1.0F;
  constexpr float kIsotropic = 0.09F;
  const SymmetricEigen<float> shape = symmetric_eigen<float>(scatter);
  const Eigen::Vector3f& values = shape.values;
  constexpr float kThin = static_cast<float>(kPlaneSigmaM) * static_cast<float>(kPlaneSigmaM);
  Eigen::Vector3f kept(kThin, kAlong, kAlong);
  if (values[1] < 0.05F * values[2]) {
    kept[1] = kThin;
  } else if (values[0] > 0.3F * values[1]) {
    kept.setConstant(kIsotropic);
  }
  return shape.vectors * kept.asDiagonal() * shape.vectors.transpose();
}

}  // namespace

RegistrationCloud::RegistrationCloud(std::span<const Eigen::Vector3f> points,
                                     std::span<const std::uint8_t> ground,
                                     const RegistrationConfig& config) {
  std::vector<Eigen::Vector3f> kept(points.begin(), points.end());
  std::vector<std::uint8_t> kept_ground(ground.begin(), ground.end());
  float leaf_m = config.leaf_m;
  thin(kept, kept_ground, leaf_m);
  while (points_.size() > config.max_points) {
    leaf_m *= 1.3F;
    kept = std::move(points_);
    kept_ground = std::move(ground_);
    points_.clear();
    ground_.clear();
    thin(kept, kept_ground, leaf_m);
  }
  tree_ = std::make_unique<PointTree>(points_);
  estimate_covariances();
}

RegistrationCloud::~RegistrationCloud() = default;

RegistrationCloud::RegistrationCloud(RegistrationCloud&&) noexcept = default;
RegistrationCloud& RegistrationCloud::operator=(RegistrationCloud&&) noexcept = default;

void RegistrationCloud::thin(const std::vector<Eigen::Vector3f>& points,
                             const std::vector<std::uint8_t>& ground, float leaf_m) {
  const float inverse = 1.0F / leaf_m;
  const float limit = leaf_m * static_cast<float>(kVoxelAxisLimit - 1);
  struct Voxel {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    std::uint32_t points = 0;
    std::uint32_t grounded = 0;
  };
  VoxelTable table;
  std::vector<Voxel> voxels;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3f& p = points[i];
    if (!p.allFinite() || p.cwiseAbs().maxCoeff() > limit) continue;
    const std::uint32_t number = table.find_or_insert(pack(voxel_index(p, inverse)));
    if (number == voxels.size()) voxels.emplace_back();
    Voxel& voxel = voxels[number];
    voxel.sum += p;
    ++voxel.points;
    if (!ground.empty()) voxel.grounded += ground[i] != 0 ? 1 : 0;
  }
  std::vector<std::pair<VoxelKey, std::uint32_t>> order;
  for (std::uint32_t i = 0; i < voxels.size(); ++i) order.emplace_back(table.key(i), i);
  std::sort(order.begin(), order.end());
  for (const auto& [key, i] : order) {
    points_.push_back(voxels[i].sum / static_cast<float>(voxels[i].points));
    ground_.push_back(2 * voxels[i].grounded > voxels[i].points ? 1 : 0);
  }
}

void RegistrationCloud::estimate_covariances() {
  constexpr std::size_t kNeighbors = 12;
  const std::size_t wanted = std::min(kNeighbors, points_.size());
  covariances_.assign(points_.size(), Eigen::Matrix3f::Identity());
  if (wanted < 5) return;
  PointTree::Neighbor neighbors[kNeighbors];
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const std::size_t found = tree_->nearest(points_[i], std::span(neighbors, wanted));
    Eigen::Vector3f mean = Eigen::Vector3f::Zero();
    for (std::size_t n = 0; n < found; ++n) mean += points_[neighbors[n].second];
    mean /= static_cast<float>(found);
    Eigen::Matrix3f scatter = Eigen::Matrix3f::Zero();
    for (std::size_t n = 0; n < found; ++n) {
      const Eigen::Vector3f d = points_[neighbors[n].second] - mean;
      scatter += d * d.transpose();
    }
    covariances_[i] = regularised(scatter);
  }
}

std::uint64_t RegistrationCloud::bytes() const {
  return sizeof *this + points_.capacity() * sizeof(Eigen::Vector3f) +
         covariances_.capacity() * sizeof(Eigen::Matrix3f) + ground_.capacity() +
         PointTree::bytes(points_.size());
}

std::uint32_t RegistrationCloud::nearest(const Eigen::Vector3f& query, float& squared_gate) const {
  return tree_->nearest(query, squared_gate);
}

}  // namespace unimapper::merge
