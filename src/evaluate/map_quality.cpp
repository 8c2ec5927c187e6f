#include "unimapper/evaluate/map_quality.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>
#include <utility>
#include <vector>

namespace unimapper::evaluate {
namespace {

/// Point set interface of nanoflann.
class CloudAdaptor {
 public:
  explicit CloudAdaptor(std::span<const Eigen::Vector3f> points) : points_(points) {}
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return points_.size(); }
  [[nodiscard]] float kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return points_[i][static_cast<Eigen::Index>(axis)];
  }
  template <typename Box>
  bool kdtree_get_bbox(Box& /*box*/) const {
    return false;
  }

 private:
  std::span<const Eigen::Vector3f> points_;
};

using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, CloudAdaptor>,
                                                 CloudAdaptor, 3, std::uint32_t>;

/// Sums over the points whose nearest neighbour is within tau.
struct DistanceSums {
  double distance = 0.0;
  double squared = 0.0;
  std::size_t count = 0;
};

DistanceSums sum_distances(std::span<const Eigen::Vector3f> from,
                           std::span<const Eigen::Vector3f> to, double tau_m) {
  DistanceSums sums;
  if (to.empty()) return sums;
  const CloudAdaptor adaptor(to);
  const Tree tree(3, adaptor, nanoflann::KDTreeSingleIndexAdaptorParams(16));
  for (const Eigen::Vector3f& point : from) {
    std::uint32_t nearest = 0;
    float squared = 0.0F;
    if (!point.allFinite() || tree.knnSearch(point.data(), 1, &nearest, &squared) == 0) continue;
    const auto squared_m2 = static_cast<double>(squared);
    if (squared_m2 >= tau_m * tau_m) continue;
    sums.squared += squared_m2;
    sums.distance += std::sqrt(squared_m2);
    ++sums.count;
  }
  return sums;
}

using Neighbours = std::vector<std::pair<std::uint32_t, float>>;

/// 1/2 ln |2 pi e Sigma| of the neighbours, or minus infinity when they are flat.
double entropy_of(std::span<const Eigen::Vector3f> cloud, const Neighbours& neighbours) {
  const Eigen::Vector3d origin = cloud[neighbours.front().first].cast<double>();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  for (const auto& [index, squared] : neighbours) {
    const Eigen::Vector3d d = cloud[index].cast<double>() - origin;
    sum += d;
    products += d * d.transpose();
  }
  const auto count = static_cast<double>(neighbours.size());
  const Eigen::Matrix3d covariance = (products - sum * sum.transpose() / count) / (count - 1.0);
  constexpr double kTwoPiE = 17.079468445347134131;
  return 0.5 * std::log(std::max(0.0, (kTwoPiE * covariance).determinant()));
}

}  // namespace

CloudAgreement compare_clouds(std::span<const Eigen::Vector3f> first,
                              std::span<const Eigen::Vector3f> second, double tau_m) {
  const DistanceSums forth = sum_distances(first, second, tau_m);
  const DistanceSums back = sum_distances(second, first, tau_m);
  CloudAgreement result;
  result.inliers_first = forth.count;
  result.inliers_second = back.count;
  if (forth.count == 0 || back.count == 0) return result;
  const auto n1 = static_cast<double>(forth.count);
  const auto n2 = static_cast<double>(back.count);
  result.ac_rmse_m = std::sqrt((forth.squared + back.squared) / (n1 + n2));
  result.ac_mean_m = (forth.distance + back.distance) / (n1 + n2);
  result.cd_l2_m = forth.distance / n1 + back.distance / n2;
  result.cd_l2_squared_m2 = forth.squared / n1 + back.squared / n2;
  return result;
}

MapEntropy map_entropy(std::span<const Eigen::Vector3f> cloud, const EntropyConfig& config) {
  MapEntropy result;
  if (cloud.empty() || config.max_queries == 0) return result;
  const CloudAdaptor adaptor(cloud);
  const Tree tree(3, adaptor, nanoflann::KDTreeSingleIndexAdaptorParams(16));
  const auto squared_radius = static_cast<float>(config.radius_m * config.radius_m);
  const nanoflann::SearchParams unsorted(32, 0.0F, false);
  const std::size_t stride = (cloud.size() + config.max_queries - 1) / config.max_queries;
  const std::size_t least = std::max<std::size_t>(config.min_neighbours, 4);
  Neighbours neighbours;
  double sum = 0.0;
  for (std::size_t i = 0; i < cloud.size(); i += stride) {
    tree.radiusSearch(cloud[i].data(), squared_radius, neighbours, unsorted);
    const double entropy = neighbours.size() < least ? -HUGE_VAL : entropy_of(cloud, neighbours);
    if (!std::isfinite(entropy)) {
      ++result.skipped;
      continue;
    }
    sum += entropy;
    ++result.points;
  }
  if (result.points > 0) result.mean = sum / static_cast<double>(result.points);
  return result;
}

}  // namespace unimapper::evaluate
