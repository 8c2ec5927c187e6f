// Tree of coordinate frames over time.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ports/datasets/bag/pose_series.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::datasets::bag {

/// Every frame has one parent, in which its pose is constant or moves: what ROS publishes on /tf
/// and /tf_static.
class TransformTree {
 public:
  /// T_parent_child at a stamp; of a frame with several parents the first one counts.
  void add(const std::string& parent, const std::string& child, std::int64_t stamp_ns,
           const Pose& pose, bool is_static);
  /// To be called when all are added.
  void finish();

  /// The frame itself, its parent, and so on up to the root.
  [[nodiscard]] std::vector<std::string> ancestors(std::string_view frame) const;
  /// True if `frame` and `other` have a common ancestor.
  [[nodiscard]] bool is_connected(std::string_view frame, std::string_view other) const;
  /// True if the pose of `frame` in `ancestor`, one of its ancestors, changes.
  [[nodiscard]] bool moves(std::string_view ancestor, std::string_view frame) const;
  /// True if the frames are connected and their poses in each other do not change.
  [[nodiscard]] bool is_rigid(std::string_view frame, std::string_view other) const;
  /// T_target_source at a stamp; empty if the frames are not connected, or a pose between them
  /// is not known then.
  [[nodiscard]] std::optional<Pose> lookup(std::string_view target, std::string_view source,
                                           std::int64_t stamp_ns) const;
  /// A frame whose poses in its parent are those of two publishers.
  struct Alternating {
    std::string frame;      ///< e.g. "base_link"
    std::string parent;     ///< e.g. "odom"
    PoseAlternation found;  ///< how often they alternate
  };
  /// The first such frame from `frame` up to `ancestor`, one of its ancestors; empty: none.
  [[nodiscard]] std::optional<Alternating> find_alternating(std::string_view ancestor,
                                                            std::string_view frame) const;
  /// Frames that were published with several parents.
  [[nodiscard]] const std::vector<std::string>& ambiguous_frames() const { return ambiguous_; }

 private:
  struct Edge {
    std::string parent;
    bool is_constant = false;
    PoseSeries poses;
  };

  /// T_ancestor_frame.
  [[nodiscard]] std::optional<Pose> up_to(std::string_view ancestor, std::string_view frame,
                                          std::int64_t stamp_ns) const;
  /// The first common ancestor; empty if there is none.
  [[nodiscard]] std::string common_ancestor(std::string_view a, std::string_view b) const;

  std::map<std::string, Edge, std::less<>> edges_;  ///< by child
  std::vector<std::string> ambiguous_;
};

}  // namespace unimapper::datasets::bag
