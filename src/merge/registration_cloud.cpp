// Thinned clouds with surface covariances and a kd-tree.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>
#include <utility>

#include "unimapper/core/symmetric_eigen.hpp"
#include "unimapper/core/voxel_key.hpp"
#include "unimapper/merge/registration.hpp"

namespace unimapper::merge {
namespace {

/// Adaptor of a vector of points for nanoflann.
struct PointSource {
  const std::vector<Eigen::Vector3f>* points;
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return points->size(); }
  [[nodiscard]] float kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return (*points)[i][static_cast<Eigen::Index>(axis)];
  }
  template <typename Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

using KdTree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, PointSource>,
                                                   PointSource, 3, std::uint32_t>;

/// Result of a search for one neighbour within a gate.
struct NearestOne {
  using DistanceType = float;
  std::uint32_t index = RegistrationCloud::kNone;
  float distance;

  [[nodiscard]] std::size_t size() const { return index == RegistrationCloud::kNone ? 0 : 1; }
  [[nodiscard]] bool full() const { return true; }
  [[nodiscard]] float worstDist() const { return distance; }
  bool addPoint(float candidate_distance, std::uint32_t candidate) {
    // A leaf offers points against the bound it started with.
    if (candidate_distance < distance) {
      distance = candidate_distance;
      index = candidate;
    }
    return true;
  }
};

/// Covariance with the eigenvectors of the local scatter and standard eigenvalues: small across a
/// surface, small in both directions across a pole, large along both, and isotropic for foliage.
Eigen::Matrix3f regularised(const Eigen::Matrix3f& scatter, float sigma_m) {
  constexpr float kAlong = 1.0F;
  constexpr float kIsotropic = 0.09F;
  const SymmetricEigen<float> shape = symmetric_eigen<float>(scatter);
  const Eigen::Vector3f& values = shape.values;
  const float thin = sigma_m * sigma_m;
  Eigen::Vector3f kept(thin, kAlong, kAlong);
  if (values[1] < 0.05F * values[2]) {
    kept[1] = thin;
  } else if (values[0] > 0.3F * values[1]) {
    kept.setConstant(kIsotropic);
  }
  return shape.vectors * kept.asDiagonal() * shape.vectors.transpose();
}

}  // namespace

struct RegistrationCloud::Tree {
  explicit Tree(const std::vector<Eigen::Vector3f>& points)
      : source{&points}, index(3, source, nanoflann::KDTreeSingleIndexAdaptorParams(12)) {}
  PointSource source;
  KdTree index;
};

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
  tree_ = std::make_unique<Tree>(points_);
  estimate_covariances(config);
}

RegistrationCloud::~RegistrationCloud() = default;

// The tree points at the vector of points, whose address changes when the cloud moves.
RegistrationCloud::RegistrationCloud(RegistrationCloud&& other) noexcept
    : points_(std::move(other.points_)),
      covariances_(std::move(other.covariances_)),
      ground_(std::move(other.ground_)),
      tree_(std::move(other.tree_)) {
  if (tree_) tree_->source.points = &points_;
}

RegistrationCloud& RegistrationCloud::operator=(RegistrationCloud&& other) noexcept {
  points_ = std::move(other.points_);
  covariances_ = std::move(other.covariances_);
  ground_ = std::move(other.ground_);
  tree_ = std::move(other.tree_);
  if (tree_) tree_->source.points = &points_;
  return *this;
}

void RegistrationCloud::thin(const std::vector<Eigen::Vector3f>& points,
                             const std::vector<std::uint8_t>& ground, float leaf_m) {
  const float inverse = 1.0F / leaf_m;
  const float limit = leaf_m * static_cast<float>(kVoxelAxisLimit - 1);
  std::vector<std::pair<VoxelKey, std::uint32_t>> keyed;
  keyed.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3f& p = points[i];
    if (!p.allFinite() || p.cwiseAbs().maxCoeff() > limit) continue;
    keyed.emplace_back(pack(voxel_index(p, inverse)), static_cast<std::uint32_t>(i));
  }
  std::sort(keyed.begin(), keyed.end());
  for (std::size_t begin = 0; begin < keyed.size();) {
    std::size_t end = begin;
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    std::size_t grounded = 0;
    for (; end < keyed.size() && keyed[end].first == keyed[begin].first; ++end) {
      sum += points[keyed[end].second];
      if (!ground.empty()) grounded += ground[keyed[end].second] != 0 ? 1 : 0;
    }
    points_.push_back(sum / static_cast<float>(end - begin));
    ground_.push_back(2 * grounded > end - begin ? 1 : 0);
    begin = end;
  }
}

void RegistrationCloud::estimate_covariances(const RegistrationConfig& config) {
  constexpr std::size_t kMaxNeighbors = 64;
  const std::size_t wanted =
      std::min<std::size_t>({config.neighbors, kMaxNeighbors, points_.size()});
  const auto sigma = static_cast<float>(config.plane_sigma_m);
  covariances_.assign(points_.size(), Eigen::Matrix3f::Identity());
  if (wanted < 5) return;
  std::uint32_t indices[kMaxNeighbors];
  float distances[kMaxNeighbors];
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const std::size_t found = tree_->index.knnSearch(points_[i].data(), wanted, indices, distances);
    Eigen::Vector3f mean = Eigen::Vector3f::Zero();
    for (std::size_t n = 0; n < found; ++n) mean += points_[indices[n]];
    mean /= static_cast<float>(found);
    Eigen::Matrix3f scatter = Eigen::Matrix3f::Zero();
    for (std::size_t n = 0; n < found; ++n) {
      const Eigen::Vector3f d = points_[indices[n]] - mean;
      scatter += d * d.transpose();
    }
    covariances_[i] = regularised(scatter, sigma);
  }
}

std::uint32_t RegistrationCloud::nearest(const Eigen::Vector3f& query, float& squared_gate) const {
  if (points_.empty()) return kNone;
  NearestOne result;
  result.distance = squared_gate;
  tree_->index.findNeighbors(result, query.data(), nanoflann::SearchParams());
  if (result.index != kNone) squared_gate = result.distance;
  return result.index;
}

}  // namespace unimapper::merge
