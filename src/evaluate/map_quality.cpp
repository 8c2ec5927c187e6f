#include "map_quality.hpp"

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

/// Of so many points every how many are `most` at most.
std::size_t stride_of(std::size_t points, std::size_t most) {
  return std::max<std::size_t>((points + most - 1) / most, 1);
}

/// Sums over the points whose nearest neighbour is within tau.
struct DistanceSums {
  double distance = 0.0;
  double squared = 0.0;
  std::size_t count = 0;
};

/// One for each threshold.
std::vector<DistanceSums> sum_distances(std::span<const Eigen::Vector3f> from,
                                        std::span<const Eigen::Vector3f> to,
                                        std::span<const double> taus_m, std::size_t max_queries) {
  std::vector<DistanceSums> sums(taus_m.size());
  if (from.empty() || to.empty()) return sums;
  const CloudAdaptor adaptor(to);
  const Tree tree(3, adaptor, nanoflann::KDTreeSingleIndexAdaptorParams(16));
  const std::size_t stride = stride_of(from.size(), max_queries);
  for (std::size_t i = 0; i < from.size(); i += stride) {
    const Eigen::Vector3f& point = from[i];
    std::uint32_t nearest = 0;
    float squared = 0.0F;
    if (!point.allFinite() || tree.knnSearch(point.data(), 1, &nearest, &squared) == 0) continue;
    const auto squared_m2 = static_cast<double>(squared);
    for (std::size_t t = 0; t < taus_m.size(); ++t) {
      if (squared_m2 >= taus_m[t] * taus_m[t]) continue;
      sums[t].squared += squared_m2;
      sums[t].distance += std::sqrt(squared_m2);
      ++sums[t].count;
    }
  }
  return sums;
}

CloudAgreement agreement(const DistanceSums& forth, const DistanceSums& back) {
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

using Neighbours = std::vector<std::pair<std::uint32_t, float>>;

/// Of a sample: two points or more.
Eigen::Matrix3d covariance_of(std::span<const Eigen::Vector3f> cloud,
                              const Neighbours& neighbours) {
  const Eigen::Vector3d origin = cloud[neighbours.front().first].cast<double>();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  for (const auto& [index, squared] : neighbours) {
    const Eigen::Vector3d d = cloud[index].cast<double>() - origin;
    sum += d;
    products += d * d.transpose();
  }
  const auto count = static_cast<double>(neighbours.size());
  return (products - sum * sum.transpose() / count) / (count - 1.0);
}

/// 1/2 ln |2 pi e Sigma| of the neighbours, or minus infinity when they are flat.
double entropy_of(std::span<const Eigen::Vector3f> cloud, const Neighbours& neighbours) {
  constexpr double kTwoPiE = 17.079468445347134131;
  return 0.5 * std::log(std::max(0.0, (kTwoPiE * covariance_of(cloud, neighbours)).determinant()));
}

}  // namespace

CloudAgreement compare_clouds(std::span<const Eigen::Vector3f> first,
                              std::span<const Eigen::Vector3f> second, double tau_m) {
  const std::size_t all = std::max<std::size_t>({first.size(), second.size(), 1});
  return compare_clouds(first, second, std::span(&tau_m, 1), all).front();
}

std::vector<CloudAgreement> compare_clouds(std::span<const Eigen::Vector3f> first,
                                           std::span<const Eigen::Vector3f> second,
                                           std::span<const double> taus_m,
                                           std::size_t max_queries) {
  const std::vector<DistanceSums> forth = sum_distances(first, second, taus_m, max_queries);
  const std::vector<DistanceSums> back = sum_distances(second, first, taus_m, max_queries);
  std::vector<CloudAgreement> results;
  results.reserve(taus_m.size());
  for (std::size_t t = 0; t < taus_m.size(); ++t) results.push_back(agreement(forth[t], back[t]));
  return results;
}

MapEntropy map_entropy(std::span<const Eigen::Vector3f> cloud, const EntropyConfig& config) {
  MapEntropy result;
  if (cloud.empty() || config.max_queries == 0) return result;
  const CloudAdaptor adaptor(cloud);
  const Tree tree(3, adaptor, nanoflann::KDTreeSingleIndexAdaptorParams(16));
  const auto squared_radius = static_cast<float>(config.radius_m * config.radius_m);
  const nanoflann::SearchParams unsorted(32, 0.0F, false);
  const std::size_t stride = stride_of(cloud.size(), config.max_queries);
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
