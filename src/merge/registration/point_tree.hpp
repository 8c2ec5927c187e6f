// Kd-tree of points whose leaves are compared by vector instructions.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace unimapper::merge {

/// Halves of halves along the longer side, down to leaves of eight points whose coordinates lie
/// side by side: most of the time of a registration goes into searches for neighbours. Immutable
/// and safe to share between threads.
class PointTree {
 public:
  /// Index of no point.
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  /// Squared distance and index.
  using Neighbor = std::pair<float, std::uint32_t>;

  /// Of finite points. O(n log n).
  explicit PointTree(std::span<const Eigen::Vector3f> points);

  /// Nearest point closer than sqrt(`squared_gate`), or kNone. On return `squared_gate` holds the
  /// squared distance of what was found.
  [[nodiscard]] std::uint32_t nearest(const Eigen::Vector3f& query, float& squared_gate) const;

  /// Of the nearest points.
  static constexpr std::size_t kMostNeighbors = 16;

  /// Fills `found`, at most `kMostNeighbors` of it, with the nearest points, the nearest first, and
  /// returns how many there are.
  std::size_t nearest(const Eigen::Vector3f& query, std::span<Neighbor> found) const;

  /// Memory that a tree of so many points takes, roughly.
  [[nodiscard]] static std::uint64_t bytes(std::size_t points);

 private:
  static constexpr std::size_t kLeaf = 8;

  /// Unused places hold points at an infinite distance.
  struct Leaf {
    std::array<Eigen::Array<float, kLeaf, 1>, 3> axes;
    std::array<std::uint32_t, kLeaf> indices;
  };
  /// What lies between two halves. The lower half follows the node.
  struct Node {
    float low = 0.0F;   ///< the upper end of the lower half
    float high = 0.0F;  ///< the lower end of the upper half
    std::uint32_t axis = kIsLeaf;
    std::uint32_t other = 0;  ///< the node of the upper half; of a leaf its position
  };
  static constexpr std::uint32_t kIsLeaf = 3;

  class Candidates;

  void build(std::span<const Eigen::Vector3f> points, std::span<std::uint32_t> indices);
  void add_leaf(std::span<const Eigen::Vector3f> points, std::span<const std::uint32_t> indices);
  /// Calls `scan` with leaves, the nearer half of every node first, as long as `bound()`, a
  /// squared distance, exceeds that to their half.
  template <typename Bound, typename Scan>
  void visit(const Eigen::Vector3f& query, const Bound& bound, const Scan& scan) const;
  [[nodiscard]] static Eigen::Array<float, kLeaf, 1> squared_distances(
      const Leaf& leaf, const Eigen::Vector3f& query);

  std::vector<Node> nodes_;
  std::vector<Leaf> leaves_;
};

}  // namespace unimapper::merge
