// Distance between the walls of two clouds: points against planes through their neighbours.
#include "wall_distance.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nanoflann.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "src/core/quantile.hpp"
#include "src/core/symmetric_eigen.hpp"

namespace unimapper::merge {
namespace {

/// Point set interface of nanoflann.
struct CloudPoints {
  std::span<const Eigen::Vector3f> points;
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
  [[nodiscard]] float kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return points[i][static_cast<Eigen::Index>(axis)];
  }
  template <typename Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

using CloudTree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, CloudPoints>,
                                        CloudPoints, 3, std::uint32_t>;
using Neighbours = std::vector<std::pair<std::uint32_t, float>>;

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
  const auto count = static_cast<double>(neighbours.size());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& [index, squared] : neighbours) mean += cloud[index].cast<double>() / count;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const auto& [index, squared] : neighbours) {
    const Eigen::Vector3d d = cloud[index].cast<double>() - mean;
    covariance += d * d.transpose() / (count - 1.0);
  }
  const auto axes = symmetric_eigen<double>(covariance);
  const Eigen::Vector3d normal = axes.vectors.col(0);
  if (axes.values[0] > kMostThicknessM * kMostThicknessM ||
      axes.values[1] < kFewestWidthM * kFewestWidthM || std::abs(normal.z()) > kSteep) {
    return std::nullopt;
  }
  return Plane{mean, normal};
}

}  // namespace

WallDistance wall_distance(std::span<const Eigen::Vector3f> first,
                           std::span<const Eigen::Vector3f> second, std::size_t max_queries) {
  constexpr float kRadiusM = 1.0F;
  WallDistance result;
  if (first.empty() || second.empty() || max_queries == 0) return result;
  const CloudPoints cloud{second};
  const CloudTree tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(16));
  const nanoflann::SearchParams unsorted(32, 0.0F, false);
  const std::size_t stride = (first.size() - 1) / max_queries + 1;
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

}  // namespace unimapper::merge
