// Kd-tree of points whose leaves are compared by vector instructions.
#include "point_tree.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

namespace unimapper::merge {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

Eigen::Index longest_side(std::span<const Eigen::Vector3f> points,
                          std::span<const std::uint32_t> indices) {
  Eigen::Array3f low = Eigen::Array3f::Constant(kInfinity);
  Eigen::Array3f high = -low;
  for (const std::uint32_t i : indices) {
    low = low.min(points[i].array());
    high = high.max(points[i].array());
  }
  Eigen::Index axis = 0;
  (high - low).maxCoeff(&axis);
  return axis;
}

}  // namespace

PointTree::PointTree(std::span<const Eigen::Vector3f> points) {
  std::vector<std::uint32_t> indices(points.size());
  std::iota(indices.begin(), indices.end(), 0U);
  leaves_.reserve(points.size() / kLeaf + 1);
  nodes_.reserve(2 * leaves_.capacity());
  if (!points.empty()) build(points, indices);
}

void PointTree::build(std::span<const Eigen::Vector3f> points, std::span<std::uint32_t> indices) {
  if (indices.size() <= kLeaf) return add_leaf(points, indices);
  const Eigen::Index axis = longest_side(points, indices);
  const auto coordinate = [&](std::uint32_t i) { return points[i][axis]; };
  // Whole leaves, so that only the last one is not full.
  const std::size_t half = (indices.size() + 2 * kLeaf - 1) / (2 * kLeaf) * kLeaf;
  const auto middle = indices.begin() + static_cast<std::ptrdiff_t>(half);
  std::nth_element(indices.begin(), middle, indices.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::pair(coordinate(a), a) < std::pair(coordinate(b), b);
  });
  const std::size_t node = nodes_.size();
  nodes_.emplace_back();
  nodes_[node].axis = static_cast<std::uint32_t>(axis);
  nodes_[node].high = coordinate(*middle);
  nodes_[node].low =
      coordinate(*std::max_element(indices.begin(), middle, [&](std::uint32_t a, std::uint32_t b) {
        return coordinate(a) < coordinate(b);
      }));
  build(points, indices.first(half));
  nodes_[node].other = static_cast<std::uint32_t>(nodes_.size());
  build(points, indices.subspan(half));
}

void PointTree::add_leaf(std::span<const Eigen::Vector3f> points,
                         std::span<const std::uint32_t> indices) {
  nodes_.push_back({.other = static_cast<std::uint32_t>(leaves_.size())});
  Leaf& leaf = leaves_.emplace_back();
  leaf.indices.fill(kNone);
  std::copy(indices.begin(), indices.end(), leaf.indices.begin());
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    auto& coordinates = leaf.axes[static_cast<std::size_t>(axis)];
    coordinates.setConstant(kInfinity);
    for (std::size_t i = 0; i < indices.size(); ++i) {
      coordinates[static_cast<Eigen::Index>(i)] = points[indices[i]][axis];
    }
  }
}

template <typename Bound, typename Scan>
void PointTree::visit(const Eigen::Vector3f& query, const Bound& bound, const Scan& scan) const {
  /// A half that waits, with its squared distance and the parts of it by axis.
  struct Waiting {
    std::uint32_t node;
    float distance;
    Eigen::Array3f parts;
  };
  // Halves of halves of 2^32 points.
  std::array<Waiting, 33> waiting;
  std::size_t count = 0;
  if (nodes_.empty()) return;
  waiting[count++] = {0, 0.0F, Eigen::Array3f::Zero()};
  while (count > 0) {
    auto [at, distance, parts] = waiting[--count];
    if (!(distance < bound())) continue;
    while (nodes_[at].axis != kIsLeaf) {
      const Node& node = nodes_[at];
      const float above_low = query[node.axis] - node.low;
      const float above_high = query[node.axis] - node.high;
      const bool is_lower = above_low + above_high < 0.0F;
      const float gap = is_lower ? above_high : above_low;
      const float part = gap * gap;
      const float other = distance - parts[node.axis] + part;
      if (other < bound()) {
        Waiting& half = waiting[count++];
        half = {is_lower ? node.other : at + 1, other, parts};
        half.parts[node.axis] = part;
      }
      at = is_lower ? at + 1 : node.other;
    }
    scan(leaves_[nodes_[at].other]);
  }
}

Eigen::Array<float, PointTree::kLeaf, 1> PointTree::squared_distances(
    const Leaf& leaf, const Eigen::Vector3f& query) {
  return (leaf.axes[0] - query.x()).square() + (leaf.axes[1] - query.y()).square() +
         (leaf.axes[2] - query.z()).square();
}

std::uint32_t PointTree::nearest(const Eigen::Vector3f& query, float& squared_gate) const {
  std::uint32_t found = kNone;
  visit(
      query, [&] { return squared_gate; },
      [&](const Leaf& leaf) {
        const auto squared = squared_distances(leaf, query);
        Eigen::Index nearest = 0;
        if (!(squared.minCoeff() < squared_gate)) return;
        squared_gate = squared.minCoeff(&nearest);
        found = leaf.indices[static_cast<std::size_t>(nearest)];
      });
  return found;
}

/// The nearest points so far, and others that may be among them. They are put in order many at a
/// time, by counting those that are nearer: branches on single distances are not predictable.
class PointTree::Candidates {
 public:
  explicit Candidates(std::size_t wanted) : wanted_(wanted) {}

  /// Squared distance that what is nearest is closer than.
  [[nodiscard]] float bound() const { return bound_; }

  void add(const Eigen::Array<float, kLeaf, 1>& squared, const Leaf& leaf) {
    for (std::size_t i = 0; i < kLeaf; ++i) {
      squared_[count_] = squared[static_cast<Eigen::Index>(i)];
      indices_[count_] = leaf.indices[i];
      count_ += squared_[count_] < bound_ ? 1 : 0;
    }
    if (count_ >= next_) keep_nearest();
  }

  std::size_t write(std::span<Neighbor> found) {
    keep_nearest();
    for (std::size_t i = 0; i < count_; ++i) found[i] = {squared_[i], indices_[i]};
    return count_;
  }

 private:
  static constexpr std::size_t kMost = 48;

  void keep_nearest() {
    const std::size_t padded = (count_ + kLeaf - 1) / kLeaf * kLeaf;
    std::fill(squared_.begin() + count_, squared_.begin() + padded, kInfinity);
    std::array<float, kMost> squared;
    std::array<std::uint32_t, kMost> indices;
    std::fill_n(indices.begin(), count_, kNone);
    for (std::size_t i = 0; i < count_; ++i) {
      std::int32_t nearer = 0;
      for (std::size_t j = 0; j < padded; ++j) nearer += squared_[j] < squared_[i] ? 1 : 0;
      auto rank = static_cast<std::size_t>(nearer);
      while (indices[rank] != kNone) ++rank;  // as near as another
      squared[rank] = squared_[i];
      indices[rank] = indices_[i];
    }
    count_ = std::min(count_, wanted_);
    std::copy_n(squared.begin(), count_, squared_.begin());
    std::copy_n(indices.begin(), count_, indices_.begin());
    if (count_ == wanted_) bound_ = squared_[count_ - 1];
    next_ = wanted_ + (count_ == wanted_ ? kLeaf : 0);
  }

  std::size_t wanted_;
  std::size_t next_ = wanted_;  ///< so many are put in order
  std::size_t count_ = 0;
  float bound_ = kInfinity;
  std::array<float, kMost> squared_;
  std::array<std::uint32_t, kMost> indices_;
};

std::size_t PointTree::nearest(const Eigen::Vector3f& query, std::span<Neighbor> found) const {
  if (found.empty()) return 0;
  Candidates candidates(std::min(found.size(), kMostNeighbors));
  visit(
      query, [&] { return candidates.bound(); },
      [&](const Leaf& leaf) { candidates.add(squared_distances(leaf, query), leaf); });
  return candidates.write(found);
}

std::uint64_t PointTree::bytes(std::size_t points) {
  const std::size_t leaves = points / kLeaf + 1;
  return leaves * (sizeof(Leaf) + 2 * sizeof(Node));
}

}  // namespace unimapper::merge
