// Nearest-neighbour search with one kd-tree per coarse voxel (paper section VI, end).
#include "voxel_trees.hpp"

#include <nanoflann.hpp>
#include <utility>

#include "src/core/voxel_key.hpp"
#include "src/merge/voxel_table.hpp"

namespace unimapper::merge {
namespace {

/// Adaptor of a voxel's points for nanoflann.
struct VoxelPoints {
  std::vector<Eigen::Vector3f> points;
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
  [[nodiscard]] float kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return points[i][static_cast<Eigen::Index>(axis)];
  }
  template <typename Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

using KdTree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, VoxelPoints>,
                                                   VoxelPoints, 3, std::uint32_t>;

/// Result set of a search that ends with the first point near enough.
struct AnyWithin {
  using DistanceType = float;
  float squared_distance;
  bool found = false;

  [[nodiscard]] std::size_t size() const { return found ? 1 : 0; }
  [[nodiscard]] bool full() const { return true; }
  [[nodiscard]] float worstDist() const { return squared_distance; }
  bool addPoint(float squared, std::uint32_t) {
    found = found || squared < squared_distance;
    return !found;
  }
};

}  // namespace

struct VoxelTrees::Trees {
  float inverse_size = 1.0F;
  VoxelTable table;
  std::vector<std::unique_ptr<VoxelPoints>> points;
  std::vector<std::unique_ptr<KdTree>> trees;

  [[nodiscard]] bool voxel_has(const VoxelIndex& voxel, const Eigen::Vector3f& point,
                               float distance_m) const {
    if (!is_representable(voxel)) return false;
    const std::uint32_t number = table.find(pack(voxel));
    if (number == VoxelTable::kNone) return false;
    AnyWithin result{distance_m * distance_m};
    trees[number]->findNeighbors(result, point.data(), nanoflann::SearchParams());
    return result.found;
  }
};

VoxelTrees::VoxelTrees(const std::vector<Eigen::Vector3f>& points, float voxel_size_m)
    : trees_(std::make_unique<Trees>()) {
  trees_->inverse_size = 1.0F / voxel_size_m;
  for (const auto& p : points) {
    const VoxelIndex voxel = voxel_index(p, trees_->inverse_size);
    if (!is_representable(voxel)) continue;
    const std::uint32_t number = trees_->table.find_or_insert(pack(voxel));
    if (number == trees_->points.size()) {
      trees_->points.push_back(std::make_unique<VoxelPoints>());
    }
    trees_->points[number]->points.push_back(p);
  }
  for (const auto& voxel : trees_->points) {
    voxel->points.shrink_to_fit();
    trees_->trees.push_back(std::make_unique<KdTree>(3, *voxel));
  }
}

std::uint64_t VoxelTrees::bytes() const {
  std::uint64_t bytes = 0;
  for (std::size_t i = 0; i < trees_->trees.size(); ++i) {
    bytes += sizeof(VoxelPoints) + trees_->points[i]->points.size() * sizeof(Eigen::Vector3f) +
             sizeof(KdTree) + trees_->trees[i]->usedMemory(*trees_->trees[i]);
  }
  return bytes;
}

VoxelTrees::~VoxelTrees() = default;
VoxelTrees::VoxelTrees(VoxelTrees&&) noexcept = default;

bool VoxelTrees::has_neighbor(const Eigen::Vector3f& point, float distance_m) const {
  const Eigen::Vector3f reach = Eigen::Vector3f::Constant(distance_m);
  const VoxelIndex low = voxel_index(point - reach, trees_->inverse_size);
  const VoxelIndex high = voxel_index(point + reach, trees_->inverse_size);
  for (std::int32_t x = low.x; x <= high.x; ++x) {
    for (std::int32_t y = low.y; y <= high.y; ++y) {
      for (std::int32_t z = low.z; z <= high.z; ++z) {
        if (trees_->voxel_has({x, y, z}, point, distance_m)) return true;
      }
    }
  }
  return false;
}

}  // namespace unimapper::merge
