// Nearest-neighbour search in a set of points.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <nanoflann.hpp>
#include <utility>
#include <vector>

namespace unimapper::bench {

/// A kd-tree with the points it is of.
class PointTree {
 public:
  explicit PointTree(std::vector<Eigen::Vector3d> points)
      : points_{std::move(points)}, tree_(3, points_, {}) {}
  PointTree(const PointTree&) = delete;  // the tree refers to the points
  PointTree& operator=(const PointTree&) = delete;

  /// Numbers of the `count` nearest points, or of all if there are fewer, nearest first.
  void nearest(const Eigen::Vector3d& query, std::size_t count,
               std::vector<std::uint32_t>& found) const {
    found.resize(count);
    if (points_.points.empty()) return found.clear();
    std::vector<double> squared_m2(count);
    found.resize(tree_.knnSearch(query.data(), count, found.data(), squared_m2.data()));
  }

  /// Calls `visit(number)` for every point within `radius_m`.
  template <typename Visit>
  void for_each_within(const Eigen::Vector3d& query, double radius_m, Visit visit) const {
    if (points_.points.empty()) return;
    std::vector<std::pair<std::uint32_t, double>> found;
    tree_.radiusSearch(query.data(), radius_m * radius_m, found,
                       nanoflann::SearchParams(32, 0.0F, false));
    for (const auto& [number, squared_m2] : found) visit(number);
  }

 private:
  /// Point set interface of nanoflann.
  struct Points {
    std::vector<Eigen::Vector3d> points;
    [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
    [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t axis) const {
      return points[i][static_cast<Eigen::Index>(axis)];
    }
    template <typename Box>
    bool kdtree_get_bbox(Box& /*box*/) const {
      return false;
    }
  };
  using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Points>,
                                                   Points, 3, std::uint32_t>;

  Points points_;
  Tree tree_;
};

}  // namespace unimapper::bench
