// Octree of points with levels of detail.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "src/apps/view/block_list.hpp"
#include "src/apps/view/point_block.hpp"
#include "unimapper/merge/external_vector.hpp"

namespace unimapper::apps {

/// Points of a cube; those of its ancestors are shown with them.
struct OctreeNode {
  std::string key;  ///< "r", then one digit for each level: bit 0 is x, bit 1 y, bit 2 z
  std::uint32_t points = 0;
  Eigen::AlignedBox3f bounds;  ///< of its points, metres
};

/// A cube and its halves, wherever there are points.
struct PointOctree {
  Eigen::Vector3f origin = Eigen::Vector3f::Zero();  ///< its lowest corner, metres
  float size_m = 0.0F;                               ///< edge of the cube "r"
  bool has_intensity = false;                        ///< of a point
  std::vector<OctreeNode> nodes;                     ///< larger cubes first
  BlockList blocks;                                  ///< `gzipped` `point_block`s by key
};

/// Points of a map, in memory or in a file.
using ViewPoints = merge::ExternalVector<ViewPoint>;

/// Points of an inner node are at least a 64th of its edge apart on a grid: the first of each cell,
/// in the order given. Points that are not finite are left out. Empty without points. Where the
/// points are in a file, the blocks are, too, and in memory are at most `kMostViewPoints` points of
/// 16 bytes beside it. O(points log points).
[[nodiscard]] PointOctree make_octree(const ViewPoints& points);

/// A cube with at most so many points is divided in memory.
inline constexpr std::size_t kMostViewPoints = std::size_t{1} << 22U;

}  // namespace unimapper::apps
