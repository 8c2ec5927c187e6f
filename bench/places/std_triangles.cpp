#include "bench/places/std_triangles.hpp"

#include <algorithm>
#include <unordered_set>
#include <utility>

#include "bench/places/point_tree.hpp"

namespace unimapper::bench {
namespace {

class TriangleForming {
 public:
  TriangleForming(const std::vector<StdKeypoint>& keypoints, const StdConfig& config)
      : keypoints_(keypoints), config_(config) {}

  /// Adds the triangle of three keypoints unless a side is too short or too long or a congruent
  /// triangle exists.
  void add(const std::array<std::uint32_t, 3>& corners) {
    // Sides with the keypoint opposite to them.
    std::array<std::pair<double, std::uint32_t>, 3> sides;
    for (std::size_t i = 0; i < 3; ++i) {
      const Eigen::Vector3d& from = keypoints_[corners[(i + 1) % 3]].position;
      const Eigen::Vector3d& to = keypoints_[corners[(i + 2) % 3]].position;
      sides[i] = {(to - from).norm(), corners[i]};
    }
    std::sort(sides.begin(), sides.end());
    if (sides[0].first < config_.min_side_m || sides[2].first > config_.max_side_m) return;
    if (!known_.insert(millimetres(sides)).second) return;

    StdTriangle& triangle = triangles_.emplace_back();
    for (std::size_t i = 0; i < 3; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      triangle.sides[row] = sides[i].first / config_.side_resolution_m;
      triangle.vertices[i] = sides[2 - i].second;
      triangle.counts[row] = keypoints_[triangle.vertices[i]].count;
    }
  }

  std::vector<StdTriangle> take() { return std::move(triangles_); }

 private:
  static std::uint64_t millimetres(const std::array<std::pair<double, std::uint32_t>, 3>& sides) {
    std::uint64_t packed = 0;
    for (const auto& [length_m, opposite] : sides) {
      packed = (packed << 21U) + static_cast<std::uint64_t>(1e3 * length_m);
    }
    return packed;
  }

  const std::vector<StdKeypoint>& keypoints_;
  const StdConfig& config_;
  std::unordered_set<std::uint64_t> known_;
  std::vector<StdTriangle> triangles_;
};

}  // namespace

std::vector<StdTriangle> form_triangles(const std::vector<StdKeypoint>& keypoints,
                                        const StdConfig& config) {
  std::vector<Eigen::Vector3d> positions;
  positions.reserve(keypoints.size());
  for (const StdKeypoint& keypoint : keypoints) positions.push_back(keypoint.position);
  const PointTree tree(std::move(positions));

  TriangleForming forming(keypoints, config);
  std::vector<std::uint32_t> nearest;
  for (std::uint32_t i = 0; i < keypoints.size(); ++i) {
    // The first is the keypoint itself.
    tree.nearest(keypoints[i].position, config.neighbours, nearest);
    for (std::size_t m = 1; m < nearest.size(); ++m) {
      for (std::size_t n = m + 1; n < nearest.size(); ++n) forming.add({i, nearest[m], nearest[n]});
    }
  }
  return forming.take();
}

}  // namespace unimapper::bench
