#include "ports/datasets/bag/transform_tree.hpp"

#include <algorithm>

namespace unimapper::datasets::bag {

void TransformTree::add(const std::string& parent, const std::string& child, std::int64_t stamp_ns,
                        const Pose& pose, bool is_static) {
  Edge& edge = edges_[child];
  if (edge.poses.is_empty()) {
    edge.parent = parent;
  } else if (edge.parent != parent) {
    if (std::find(ambiguous_.begin(), ambiguous_.end(), child) == ambiguous_.end()) {
      ambiguous_.push_back(child);
    }
    return;
  }
  edge.is_constant = edge.is_constant || is_static;
  edge.poses.add(stamp_ns, pose);
}

void TransformTree::finish() {
  for (auto& [child, edge] : edges_) {
    edge.poses.finish();
    edge.is_constant = edge.is_constant || edge.poses.is_constant();
  }
}

std::vector<std::string> TransformTree::ancestors(std::string_view frame) const {
  std::vector<std::string> chain = {std::string(frame)};
  auto edge = edges_.find(frame);
  // Frames that are each other's parents end the walk.
  while (edge != edges_.end() && chain.size() <= edges_.size()) {
    chain.push_back(edge->second.parent);
    edge = edges_.find(edge->second.parent);
  }
  return chain;
}

std::string TransformTree::common_ancestor(std::string_view a, std::string_view b) const {
  const std::vector<std::string> above_b = ancestors(b);
  for (const std::string& frame : ancestors(a)) {
    if (std::find(above_b.begin(), above_b.end(), frame) != above_b.end()) return frame;
  }
  return {};
}

bool TransformTree::is_connected(std::string_view frame, std::string_view other) const {
  return !common_ancestor(frame, other).empty();
}

bool TransformTree::moves(std::string_view ancestor, std::string_view frame) const {
  for (const std::string& child : ancestors(frame)) {
    if (child == ancestor) return false;
    const auto edge = edges_.find(child);
    if (edge != edges_.end() && !edge->second.is_constant) return true;
  }
  return false;
}

bool TransformTree::is_rigid(std::string_view frame, std::string_view other) const {
  const std::string common = common_ancestor(frame, other);
  return !common.empty() && !moves(common, frame) && !moves(common, other);
}

std::optional<TransformTree::Alternating> TransformTree::find_alternating(
    std::string_view ancestor, std::string_view frame) const {
  for (const std::string& child : ancestors(frame)) {
    if (child == ancestor) break;
    const auto edge = edges_.find(child);
    if (edge == edges_.end() || edge->second.is_constant) continue;
    const PoseAlternation found = edge->second.poses.alternation();
    if (found.is_of_two()) return Alternating{child, edge->second.parent, found};
  }
  return std::nullopt;
}

std::optional<Pose> TransformTree::up_to(std::string_view ancestor, std::string_view frame,
                                         std::int64_t stamp_ns) const {
  Pose T_ancestor_frame;
  for (const std::string& child : ancestors(frame)) {
    if (child == ancestor) return T_ancestor_frame;
    const auto edge = edges_.find(child);
    if (edge == edges_.end()) return std::nullopt;
    const PoseSeries& poses = edge->second.poses;
    const auto pose = poses.at(edge->second.is_constant ? poses.last_ns() : stamp_ns);
    if (!pose) return std::nullopt;
    T_ancestor_frame = *pose * T_ancestor_frame;
  }
  return std::nullopt;
}

std::optional<Pose> TransformTree::lookup(std::string_view target, std::string_view source,
                                          std::int64_t stamp_ns) const {
  const std::string common = common_ancestor(target, source);
  if (common.empty()) return std::nullopt;
  const auto T_common_target = up_to(common, target, stamp_ns);
  const auto T_common_source = up_to(common, source, stamp_ns);
  if (!T_common_target || !T_common_source) return std::nullopt;
  return T_common_target->inverse() * *T_common_source;
}

}  // namespace unimapper::datasets::bag
