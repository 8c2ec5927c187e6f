// Poses of a bag's LiDAR, from odometry or transforms.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ports/datasets/bag/messages.hpp"
#include "ports/datasets/bag/pose_series.hpp"
#include "ports/datasets/bag/transform_tree.hpp"
#include "ports/datasets/dataset.hpp"
#include "ports/datasets/recorded_stamps.hpp"

namespace unimapper::datasets::bag {

/// Whose poses a topic holds, in which frame, and how many.
struct PoseFrames {
  std::string frame;        ///< the poses are given in
  std::string child_frame;  ///< whose poses they are; empty where the messages do not say
  std::size_t poses = 0;    ///< how many have both frames
};

/// The poses that one topic holds. Those of several frames are several trajectories: the one with
/// most poses is kept, the first one of as many.
struct PoseTopic {
  std::string description;           ///< of the topic
  std::string frame;                 ///< the poses are given in
  std::string child_frame;           ///< as in `PoseFrames`
  std::vector<PoseFrames> left_out;  ///< in the order of recording
  PoseSeries poses;                  ///< T_frame_child
  /// In the order of recording, until `BagPoses::finish`.
  struct Recorded {
    std::int64_t stamp_ns;  ///< of the pose
    std::int64_t log_ns;    ///< when it was recorded
    Pose pose;              ///< T_frame_child
    std::size_t frames;     ///< index of `frames`
  };
  std::vector<PoseFrames> frames;  ///< of `recorded`, in the order of recording
  std::map<std::pair<std::string, std::string>, std::size_t> frames_index;  ///< by their names
  std::vector<Recorded> recorded;  ///< in the order of recording, until `BagPoses::finish`
  RecordedStamps stamps;           ///< what contradicts the order of recording
  bool is_path = false;            ///< its poses were recorded together
  bool is_odometry = false;        ///< odometry, or asked for: comes before the transforms
  std::size_t invalid = 0;         ///< left out: not finite, or no rotation
};

/// All poses of a bag that may be of use.
struct BagPoses {
  std::map<std::size_t, PoseTopic> topics;  ///< by number of the topic
  /// All transforms, static ones included.
  TransformTree transforms;

  /// Takes the poses of one message; `topic` is empty for those of transforms.
  void add(const PoseMessage& message, PoseTopic* topic, bool is_static, std::int64_t log_ns);
  /// To be called when all messages are taken. `scans` are the stamps of the scans: a clock that
  /// steps in both is one clock.
  void finish(RecordedStamps& scans);
};

/// Where a scan's pose comes from.
struct LidarPoses {
  std::function<std::optional<Pose>(std::int64_t stamp_ns)> at;  ///< T_odometry_lidar
  std::string description;    ///< e.g. "/odom (nav_msgs/Odometry, 900 messages)"
  std::string covered_time;   ///< from when to when, for messages; may be empty
  std::int64_t first_ns = 0;  ///< of the poses, where `apart` says how far apart they are
  std::int64_t last_ns = 0;   ///< as well
  std::string apart;          ///< how far apart they are in time, for messages; may be empty
  /// The other reading of poses whose frames are named the wrong way round; may be empty.
  std::function<std::optional<Pose>(std::int64_t stamp_ns)> inverted;
  /// T_base_lidar of the bag's transforms, where it does not move.
  std::optional<Pose> mount;
  std::vector<Note> notes;   ///< what was chosen, and warnings
  bool is_mounted = false;   ///< by the bag's transforms
  bool is_of_topic = false;  ///< by the clock that `RecordedStamps` gives them
  bool are_missing = false;  ///< the recording has none, and each is the identity
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

/// Of a recording without poses.
LidarPoses missing_poses();

/// Poses of the only odometry; else of the transforms; else of the only topic with poses; else
/// `missing_poses`. Throws DatasetError (without naming a file) where several fit, or two
/// publishers are mixed. The result refers to `poses`.
LidarPoses find_lidar_poses(const BagPoses& poses, const PoseWish& wish);

}  // namespace unimapper::datasets::bag
