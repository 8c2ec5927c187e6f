#include "src/apps/view/point_octree.hpp"

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <memory>
#include <utility>

namespace unimapper::apps {
namespace {

/// Cells of a node along an edge.
constexpr int kCells = 64;
/// A node with so few points has no children.
constexpr std::size_t kLeafPoints = 8000;
/// Deeper nodes would be smaller than a millimetre.
constexpr std::size_t kDeepest = 20;
constexpr float kSmallestM = 1.0F;

/// A cube whose points are not divided yet.
struct OpenNode {
  std::string key;
  Eigen::Vector3f origin;
  float size_m = 0.0F;
  ViewPoints points;
};

using Occupancy = std::bitset<static_cast<std::size_t>(kCells) * kCells * kCells>;

std::size_t cell_of(const OpenNode& node, const Eigen::Vector3f& position) {
  std::size_t cell = 0;
  for (int axis = 2; axis >= 0; --axis) {
    const float at = (position[axis] - node.origin[axis]) / node.size_m * kCells;
    cell =
        cell * kCells + static_cast<std::size_t>(std::clamp(static_cast<int>(at), 0, kCells - 1));
  }
  return cell;
}

std::size_t octant_of(const OpenNode& node, const Eigen::Vector3f& position) {
  const Eigen::Vector3f centre = node.origin.array() + 0.5F * node.size_m;
  std::size_t octant = 0;
  for (int axis = 0; axis < 3; ++axis) {
    if (position[axis] >= centre[axis]) octant |= std::size_t{1} << axis;
  }
  return octant;
}

OpenNode child_of(const OpenNode& node, std::size_t octant) {
  OpenNode child;
  child.key = node.key + static_cast<char>('0' + octant);
  child.size_m = 0.5F * node.size_m;
  child.origin = node.origin;
  for (int axis = 0; axis < 3; ++axis) {
    if ((octant >> axis & 1U) != 0) child.origin[axis] += child.size_m;
  }
  return child;
}

/// The points that a node shows.
struct Kept {
  std::vector<ViewPoint> points;
  Eigen::AlignedBox3f bounds;

  void add(const ViewPoint& point) {
    points.push_back(point);
    bounds.extend(point.position);
  }
};

/// Keeps what the node shows; the rest goes to its children, by octant.
Kept divide(const OpenNode& node, std::array<ViewPoints, 8>& rest) {
  Kept kept;
  const bool is_leaf = node.points.size() <= kLeafPoints || node.key.size() > kDeepest;
  const auto occupied = std::make_unique<Occupancy>();
  for (const ViewPoint& point : node.points) {
    if (!point.position.allFinite()) continue;
    const std::size_t cell = cell_of(node, point.position);
    if (is_leaf || !occupied->test(cell)) {
      occupied->set(cell);
      kept.add(point);
    } else {
      rest[octant_of(node, point.position)].push_back(point);
    }
  }
  return kept;
}

OpenNode root_of(const ViewPoints& points) {
  Eigen::AlignedBox3f bounds;
  OpenNode root;
  root.key = "r";
  root.points = points;
  for (const ViewPoint& point : points) {
    if (point.position.allFinite()) bounds.extend(point.position);
  }
  if (bounds.isEmpty()) bounds.extend(Eigen::Vector3f::Zero());
  root.origin = bounds.min().array().floor();
  root.size_m = std::max(kSmallestM, std::ceil((bounds.max() - root.origin).maxCoeff()));
  return root;
}

/// A node and all below it. One branch at a time, so that few points are in memory.
void add_nodes(OpenNode node, PointOctree& octree) {
  std::array<ViewPoints, 8> rest;
  if (node.points.size() > kMostViewPoints) rest.fill(ViewPoints(node.points.file()));
  {
    const Kept kept = divide(node, rest);
    if (kept.points.empty()) return;
    octree.nodes.push_back({node.key, static_cast<std::uint32_t>(kept.points.size()), kept.bounds});
    octree.has_intensity = octree.has_intensity || has_intensity(kept.points);
    octree.blocks.add(node.key,
                      gzipped(point_block(kept.points, node.origin, node.size_m / 65535.0F)));
  }
  node.points = ViewPoints();
  for (std::size_t octant = 0; octant < rest.size(); ++octant) {
    if (rest[octant].empty()) continue;
    OpenNode child = child_of(node, octant);
    child.points = std::move(rest[octant]);
    add_nodes(std::move(child), octree);
  }
}

}  // namespace

PointOctree make_octree(const ViewPoints& points) {
  PointOctree octree;
  octree.blocks = BlockList(points.file());
  if (points.empty()) return octree;
  OpenNode root = root_of(points);
  octree.origin = root.origin;
  octree.size_m = root.size_m;
  add_nodes(std::move(root), octree);
  std::sort(octree.nodes.begin(), octree.nodes.end(), [](const OctreeNode& a, const OctreeNode& b) {
    return a.key.size() != b.key.size() ? a.key.size() < b.key.size() : a.key < b.key;
  });
  return octree;
}

}  // namespace unimapper::apps
