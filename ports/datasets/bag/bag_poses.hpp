// Poses of a bag's LiDAR, from odometry or transforms.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "ports/datasets/bag/messages.hpp"
#include "ports/datasets/bag/pose_series.hpp"
#include "ports/datasets/bag/transform_tree.hpp"
#include "ports/datasets/dataset.hpp"

namespace unimapper::datasets::bag {

/// The poses that one topic holds.
struct PoseTopic {
  std::string description;   ///< of the topic
  std::string frame;         ///< they are given in
  std::string child_frame;   ///< whose poses they are; empty where the messages do not say
  PoseSeries poses;          ///< T_frame_child
  bool is_odometry = false;  ///< or asked for: comes before the transforms
  std::size_t invalid = 0;   ///< left out: not finite, or no rotation
};

/// All poses of a bag that may be of use.
struct BagPoses {
  std::map<std::size_t, PoseTopic> topics;  ///< by number of the topic
  /// All transforms, static ones included.
  TransformTree transforms;

  /// Takes the poses of one message; `topic` is empty for those of transforms.
  void add(const PoseMessage& message, PoseTopic* topic, bool is_static);
  /// To be called when all messages are taken.
  void finish();
};

/// Where a scan's pose comes from.
struct LidarPoses {
  std::function<std::optional<Pose>(std::int64_t stamp_ns)> at;  ///< T_odometry_lidar
  std::string description;   ///< e.g. "/odom (nav_msgs/Odometry, 900 messages)"
  std::string covered_time;  ///< from when to when, for messages; may be empty
  std::vector<Note> notes;   ///< what was chosen, and warnings
};

/// How the poses of the LiDAR's frame are found.
struct PoseWish {
  std::string lidar_frame;                ///< of the scans
  std::string fixed_frame;                ///< of the poses, among the transforms; empty: chosen
  bool is_mounted_by_caller = false;      ///< poses of the robot's base are wanted as they are
  bool refuses_unknown_mounting = false;  ///< where the LiDAR is on the robot must be known
};

/// Seconds with three decimals, for messages.
std::string seconds_text(std::int64_t stamp_ns);

/// Poses of the only odometry; else of the transforms; else of the only topic with poses. Throws
/// DatasetError (without naming a file) where there are none, or several fit. The result refers to
/// `poses`.
LidarPoses find_lidar_poses(const BagPoses& poses, const PoseWish& wish);

}  // namespace unimapper::datasets::bag
