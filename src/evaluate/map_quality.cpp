#include "unimapper/evaluate/map_quality.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "unimapper/core/quantile.hpp"
#include "unimapper/core/symmetric_eigen.hpp"

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

struct Distribution {
  Eigen::Vector3d mean;
  Eigen::Matrix3d covariance;  ///< of a sample
};

/// Of two points or more.
Distribution distribution_of(std::span<const Eigen::Vector3f> cloud, const Neighbours& neighbours) {
  const Eigen::Vector3d origin = cloud[neighbours.front().first].cast<double>();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  for (const auto& [index, squared] : neighbours) {
    const Eigen::Vector3d d = cloud[index].cast<double>() - origin;
    sum += d;
    products += d * d.transpose();
  }
  const auto count = static_cast<double>(neighbours.size());
  return {origin + sum / count, (products - sum * sum.transpose() / count) / (count - 1.0)};
}

struct Plane {
  Eigen::Vector3d mean;
  Eigen::Vector3d normal;  ///< of length one
};

/// The plane through the neighbours, if they are enough, flat, and steep.
std::optional<Plane> wall_through(std::span<const Eigen::Vector3f> cloud,
                                  const Neighbours& neighbours) {
  constexpr std::size_t kFewest = 12;
  constexpr double kMostThicknessM = 0.15;
  constexpr double kFewestWidthM = 0.25;
  constexpr double kSteep = 0.3;  // the normal's z: 17 degrees from horizontal
  if (neighbours.size() < kFewest) return std::nullopt;
  const Distribution of = distribution_of(cloud, neighbours);
  const auto axes = symmetric_eigen<double>(of.covariance);
  const Eigen::Vector3d normal = axes.vectors.col(0);
  if (axes.values[0] > kMostThicknessM * kMostThicknessM ||
      axes.values[1] < kFewestWidthM * kFewestWidthM || std::abs(normal.z()) > kSteep) {
    return std::nullopt;
  }
  return Plane{of.mean, normal};
}

/// 1/2 ln |2 pi e Sigma| of the neighbours, or minus infinity when they are flat.
double entropy_of(std::span<const Eigen::Vector3f> cloud, const Neighbours& neighbours) {
  const Eigen::Matrix3d covariance = distribution_of(cloud, neighbours).covariance;
  constexpr double kTwoPiE = 17.079468445347134131;
  return 0.5 * std::log(std::max(0.0, (kTwoPiE * covariance).determinant()));
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

WallDistance wall_distance(std::span<const Eigen::Vector3f> first,
                           std::span<const Eigen::Vector3f> second) {
  constexpr std::size_t kMostQueries = 20'000;
  constexpr float kRadiusM = 1.0F;
  WallDistance result;
  if (first.empty() || second.empty()) return result;
  const CloudAdaptor adaptor(second);
  const Tree tree(3, adaptor, nanoflann::KDTreeSingleIndexAdaptorParams(16));
  const nanoflann::SearchParams unsorted(32, 0.0F, false);
  const std::size_t stride = stride_of(first.size(), kMostQueries);
  Neighbours neighbours;
  std::vector<double> distances;
  for (std::size_t i = 0; i < first.size(); i += stride) {
    if (!first[i].allFinite()) continue;
    tree.radiusSearch(first[i].data(), kRadiusM * kRadiusM, neighbours, unsorted);
    if (const auto plane = wall_through(second, neighbours)) {
      const Eigen::Vector3d from_plane = first[i].cast<double>() - plane->mean;
      distances.push_back(std::abs(plane->normal.dot(from_plane)));
    }
  }
  result.points = distances.size();
  if (distances.empty()) return result;
  result.median_m = median(std::span(distances));
  result.p90_m = quantile(std::span(distances), 0.9);
  return result;
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
