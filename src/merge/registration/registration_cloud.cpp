// Thinned clouds with surface covariances and a kd-tree.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "point_tree.hpp"
#include "registration.hpp"
#include "src/core/voxel_key.hpp"
#include "src/merge/voxel_table.hpp"
#include "surface_model.hpp"

namespace unimapper::merge {
namespace {

constexpr std::size_t kFewestNeighbors = 5;

/// Eigenvalues of a positive matrix whose trace is 1, ascending; the smallest may be too small
/// where the others are near to it.
Eigen::Vector3d eigenvalues(const Eigen::Matrix3d& m) {
  const double c1 = m(0, 0) * m(1, 1) - m(0, 1) * m(0, 1) + m(0, 0) * m(2, 2) - m(0, 2) * m(0, 2) +
                    m(1, 1) * m(2, 2) - m(1, 2) * m(1, 2);
  const double c0 = m.determinant();
  // Newton from zero approaches the smallest root from below.
  constexpr int kMostSteps = 12;
  constexpr double kSmallStep = 1e-7;
  double low = 0.0;
  for (int i = 0; i < kMostSteps; ++i) {
    const double slope = (3.0 * low - 2.0) * low + c1;
    const double value = ((low - 1.0) * low + c1) * low - c0;
    if (!(slope > 0.0) || !(-value > kSmallStep * slope)) break;
    low -= value / slope;
  }
  const double half = 0.5 * (1.0 - low);
  const double apart = std::sqrt(std::max(0.0, half * half - (c1 - 2.0 * half * low)));
  return {low, half - apart, half + apart};
}

/// Unit eigenvector of an eigenvalue that is far from the others.
Eigen::Vector3d eigenvector(Eigen::Matrix3d m, double value) {
  m.diagonal().array() -= value;
  // The rows span the plane across it.
  const Eigen::Vector3d x = m.row(0);
  const Eigen::Vector3d y = m.row(1);
  const Eigen::Vector3d z = m.row(2);
  Eigen::Vector3d longest = x.cross(y);
  for (const Eigen::Vector3d& other : {Eigen::Vector3d(x.cross(z)), Eigen::Vector3d(y.cross(z))}) {
    if (other.squaredNorm() > longest.squaredNorm()) longest = other;
  }
  return longest.normalized();
}

/// Covariance with the eigenvectors of the local scatter and standard eigenvalues: small across a
/// surface, small in both directions across a pole, large along both, and isotropic for foliage.
Eigen::Matrix3f regularised(const Eigen::Matrix3f& scatter) {
  constexpr float kAlong = 1.0F;
  constexpr float kIsotropic = 0.09F;
  constexpr float kThin = static_cast<float>(kPlaneSigmaM) * static_cast<float>(kPlaneSigmaM);
  const auto with = [](float along, float others, const Eigen::Vector3d& axis) {
    const Eigen::Vector3f n = axis.cast<float>();
    return Eigen::Matrix3f(others * Eigen::Matrix3f::Identity() +
                           (along - others) * n * n.transpose());
  };
  const float trace = scatter.trace();
  if (!(trace > std::numeric_limits<float>::min())) {
    return with(kThin, kAlong, Eigen::Vector3d::UnitX());
  }
  const Eigen::Matrix3d m = scatter.cast<double>() / static_cast<double>(trace);
  const Eigen::Vector3d values = eigenvalues(m);
  if (values[1] < 0.05 * values[2]) return with(kAlong, kThin, eigenvector(m, values[2]));
  if (values[0] > 0.3 * values[1]) return kIsotropic * Eigen::Matrix3f::Identity();
  return with(kThin, kAlong, eigenvector(m, values[0]));
}

}  // namespace

RegistrationCloud::RegistrationCloud(std::span<const Eigen::Vector3f> points,
                                     std::span<const std::uint8_t> ground,
                                     const RegistrationConfig& config)
    : leaf_m_(config.leaf_m) {
  points_.reserve(points.size());
  ground_.reserve(points.size());
  const float limit_m = config.leaf_m * static_cast<float>(kVoxelAxisLimit - 1);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points[i].allFinite() || points[i].cwiseAbs().maxCoeff() > limit_m) continue;
    points_.push_back(points[i]);
    ground_.push_back(ground.empty() ? 0 : ground[i]);
  }
  std::vector<VoxelKey> keys = thin();
  while (points_.size() > config.max_points) {
    leaf_m_ *= 1.3F;
    keys = thin();
  }
  sort_by(keys);
  tree_ = std::make_unique<PointTree>(points_);
  covariances_.assign(points_.size(), Eigen::Matrix3f::Identity());
  states_.assign(points_.size(), points_.size() < kFewestNeighbors ? kKnown : kUnknown);
}

RegistrationCloud::~RegistrationCloud() = default;

RegistrationCloud::RegistrationCloud(RegistrationCloud&&) noexcept = default;
RegistrationCloud& RegistrationCloud::operator=(RegistrationCloud&&) noexcept = default;

std::vector<VoxelKey> RegistrationCloud::thin() {
  const float inverse = 1.0F / leaf_m_;
  struct Voxel {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    std::uint32_t points = 0;
    std::uint32_t grounded = 0;
  };
  VoxelTable table(points_.size());
  std::vector<Voxel> voxels;
  voxels.reserve(points_.size());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const std::uint32_t number = table.find_or_insert(pack(voxel_index(points_[i], inverse)));
    if (number == voxels.size()) voxels.emplace_back();
    Voxel& voxel = voxels[number];
    voxel.sum += points_[i];
    ++voxel.points;
    voxel.grounded += ground_[i] != 0 ? 1 : 0;
  }
  points_.resize(voxels.size());
  ground_.resize(voxels.size());
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    points_[i] = voxels[i].sum / static_cast<float>(voxels[i].points);
    ground_[i] = 2 * voxels[i].grounded > voxels[i].points ? 1 : 0;
  }
  return table.keys();
}

void RegistrationCloud::sort_by(const std::vector<VoxelKey>& keys) {
  std::vector<std::pair<VoxelKey, std::uint32_t>> order;
  order.reserve(keys.size());
  for (std::uint32_t i = 0; i < keys.size(); ++i) order.emplace_back(keys[i], i);
  std::sort(order.begin(), order.end());
  const std::vector<Eigen::Vector3f> points = points_;
  const std::vector<std::uint8_t> ground = ground_;
  for (std::size_t i = 0; i < order.size(); ++i) {
    points_[i] = points[order[i].second];
    ground_[i] = ground[order[i].second];
  }
}

Eigen::Matrix3f RegistrationCloud::estimate_covariance(std::size_t i) const {
  constexpr std::size_t kNeighbors = 12;
  PointTree::Neighbor neighbors[kNeighbors];
  const std::size_t wanted = std::min(kNeighbors, points_.size());
  const std::size_t found = tree_->nearest(points_[i], std::span(neighbors, wanted));
  // Four numbers fill a register: sums that are written and read by parts are slow.
  Eigen::Array4f sum = Eigen::Array4f::Zero();
  Eigen::Array4f by_x = sum;
  Eigen::Array4f by_y = sum;
  Eigen::Array4f by_z = sum;
  for (std::size_t n = 0; n < found; ++n) {
    const Eigen::Vector3f away = points_[neighbors[n].second] - points_[i];
    const Eigen::Array4f d(away.x(), away.y(), away.z(), 0.0F);
    sum += d;
    by_x += away.x() * d;
    by_y += away.y() * d;
    by_z += away.z() * d;
  }
  Eigen::Matrix3f scatter;
  scatter << by_x.head<3>(), by_y.head<3>(), by_z.head<3>();
  const Eigen::Vector3f sums = sum.head<3>();
  scatter -= sums * sums.transpose() / static_cast<float>(found);
  return regularised(scatter);
}

Eigen::Matrix3f RegistrationCloud::made_covariance(std::size_t i) const {
  const Eigen::Matrix3f made = estimate_covariance(i);
  const std::atomic_ref<std::uint8_t> state(states_[i]);
  std::uint8_t unknown = kUnknown;
  if (state.compare_exchange_strong(unknown, kBeingWritten, std::memory_order_relaxed)) {
    covariances_[i] = made;
    state.store(kKnown, std::memory_order_release);
  }
  return made;
}

std::uint64_t RegistrationCloud::bytes() const {
  return sizeof *this + points_.capacity() * sizeof(Eigen::Vector3f) +
         covariances_.capacity() * sizeof(Eigen::Matrix3f) + ground_.capacity() +
         states_.capacity() + PointTree::bytes(points_.size());
}

std::uint32_t RegistrationCloud::nearest(const Eigen::Vector3f& query, float& squared_gate) const {
  return tree_->nearest(query, squared_gate);
}

}  // namespace unimapper::merge
