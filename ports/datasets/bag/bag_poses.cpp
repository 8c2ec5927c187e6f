#include "ports/datasets/bag/bag_poses.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

#include "ports/datasets/pose_track.hpp"
#include "ports/datasets/poses.hpp"

namespace unimapper::datasets::bag {

namespace {

std::string extrinsic_text(const Pose& T_base_lidar) {
  const Eigen::Vector3d& t = T_base_lidar.translation;
  const Eigen::Matrix3d& r = T_base_lidar.rotation;
  // Without the sign of a zero.
  const auto degrees = [](double radians) {
    return std::round(radians * kDegreesPerRadian * 10.0) / 10.0 + 0.0;
  };
  const double roll = degrees(std::atan2(r(2, 1), r(2, 2)));
  const double pitch = degrees(std::asin(std::clamp(-r(2, 0), -1.0, 1.0)));
  const double yaw = degrees(std::atan2(r(1, 0), r(0, 0)));
  std::array<char, 160> text;
  std::snprintf(text.data(), text.size(),
                "x %.3f, y %.3f, z %.3f m, roll %.1f, pitch %.1f, yaw %.1f degrees", t.x(), t.y(),
                t.z(), roll, pitch, yaw);
  return text.data();
}

std::string quoted(const std::string& frame) { return "'" + frame + "'"; }

/// The frame whose poses a topic holds; guessed where its messages do not say.
std::string base_frame_of(const PoseTopic& topic, const TransformTree& transforms,
                          const std::string& lidar_frame) {
  if (!topic.child_frame.empty()) return topic.child_frame;
  for (const char* name : {"base_link", "base_footprint"}) {
    if (transforms.is_connected(name, lidar_frame)) return name;
  }
  return lidar_frame;
}

std::string remedy_for_mounting() {
  return "say where the LiDAR is on what the poses are of with --extrinsic x,y,z,roll,pitch,yaw";
}

/// The LiDAR is fixed to the base of a robot, not to the frame that the base moves in.
bool are_frames_swapped(const PoseTopic& topic, const TransformTree& transforms,
                        const std::string& lidar_frame) {
  constexpr std::array<std::string_view, 4> kFixed = {"odom", "odometry", "map", "world"};
  if (topic.frame.empty() || topic.child_frame.empty()) return false;
  if (topic.frame == lidar_frame) {
    return std::find(kFixed.begin(), kFixed.end(), topic.child_frame) != kFixed.end();
  }
  return transforms.is_rigid(topic.frame, lidar_frame) &&
         !transforms.is_rigid(topic.child_frame, lidar_frame);
}

/// Says which trajectories of a topic are left out.
void note_frames(const PoseTopic& topic, std::vector<Note>& notes) {
  if (topic.left_out.empty()) return;
  constexpr std::size_t kMostNamed = 4;
  std::string list;
  std::size_t named = 0;
  std::size_t others = 0;
  for (const PoseFrames& frames : topic.left_out) {
    if (named++ >= kMostNamed) {
      others += frames.poses;
      continue;
    }
    list += (list.empty() ? "" : ", ") + std::to_string(frames.poses) + " of " +
            quoted(frames.child_frame) + " in " + quoted(frames.frame);
  }
  if (others > 0) list += ", " + std::to_string(others) + " of others";
  notes.push_back({topic.description + " holds poses of several frames: those of " +
                       quoted(topic.child_frame) + " in " + quoted(topic.frame) +
                       " are taken, left out are " + list,
                   true});
}

void note_invalid(const PoseTopic& topic, std::vector<Note>& notes) {
  if (topic.invalid == 0) return;
  notes.push_back({std::to_string(topic.invalid) + " poses of " + topic.description +
                       " are not finite or no rotation: left out",
                   true});
}

[[noreturn]] void fail_alternating(const std::string& whose, const PoseAlternation& found) {
  throw DatasetError("the poses of " + whose + " " + alternation_text(found) +
                     "; does a second node publish there?");
}

LidarPoses from_topic(const PoseTopic& topic, const TransformTree& transforms,
                      const PoseWish& wish) {
  const PoseAlternation alternation = topic.poses.alternation();
  if (alternation.is_of_two()) fail_alternating(topic.description, alternation);
  const std::string& lidar_frame = wish.lidar_frame;
  LidarPoses poses;
  poses.is_of_topic = !topic.is_path;
  poses.description = topic.description;
  poses.covered_time =
      seconds_text(topic.poses.first_ns()) + " to " + seconds_text(topic.poses.last_ns()) + " s";
  poses.first_ns = topic.poses.first_ns();
  poses.last_ns = topic.poses.last_ns();
  poses.apart = poses_apart_text(topic.poses.stamps_ns());
  const bool is_swapped = are_frames_swapped(topic, transforms, lidar_frame);
  if (!is_swapped && topic.frame == lidar_frame && !topic.child_frame.empty() &&
      topic.child_frame != lidar_frame) {
    throw DatasetError("the scans lie in " + quoted(lidar_frame) + ", the fixed frame of " +
                       topic.description +
                       ", so they are no longer as the LiDAR saw them; choose its raw scans with "
                       "--topic");
  }
  const std::string base = is_swapped ? topic.frame : base_frame_of(topic, transforms, lidar_frame);
  const std::string chosen = "poses: " + topic.description + ", of " + quoted(base) + " in " +
                             quoted(is_swapped ? topic.child_frame : topic.frame);
  note_frames(topic, poses.notes);
  note_stamps(topic.stamps, "pose", topic.description, poses.notes);
  note_invalid(topic, poses.notes);
  if (2 * topic.poses.repeated() > topic.poses.stamps_ns().size()) {
    poses.notes.push_back({std::to_string(topic.poses.repeated()) + " poses of " +
                               topic.description +
                               " have the stamp of another: of each stamp the last one is taken",
                           true});
  }
  if (topic.child_frame.empty()) {
    const bool is_mounted = base != lidar_frame || wish.is_mounted_by_caller;
    poses.notes.push_back({topic.description + " does not say whose poses it holds: taken for " +
                               "those of " + quoted(base) +
                               (is_mounted ? std::string() : "; " + remedy_for_mounting()),
                           base != lidar_frame, !is_mounted});
  }
  if (base == lidar_frame || wish.is_mounted_by_caller) {
    poses.notes.push_back({chosen, false});
    poses.at = [&topic](std::int64_t stamp_ns) { return topic.poses.at(stamp_ns); };
    if (is_swapped) {
      poses.inverted = [&topic](std::int64_t stamp_ns) {
        const auto T_lidar_odometry = topic.poses.at(stamp_ns);
        return T_lidar_odometry ? std::optional<Pose>(T_lidar_odometry->inverse()) : std::nullopt;
      };
    }
    return poses;
  }
  if (!transforms.is_connected(base, lidar_frame)) {
    if (wish.refuses_unknown_mounting) {
      throw DatasetError("no transform between " + quoted(base) + " and the LiDAR's frame " +
                         quoted(lidar_frame) +
                         " is in the bag; of several LiDARs say where each is mounted, "
                         "--extrinsic x,y,z,roll,pitch,yaw once for each in the order of --topic");
    }
    poses.notes.push_back({chosen, false});
    poses.notes.push_back({"no transform between " + quoted(base) + " and the LiDAR's frame " +
                               quoted(lidar_frame) +
                               " is in the bag: the LiDAR is taken to lie at " + quoted(base) +
                               ", its axes along the base's; " + remedy_for_mounting(),
                           true, true});
    poses.at = [&topic](std::int64_t stamp_ns) { return topic.poses.at(stamp_ns); };
    return poses;
  }
  poses.at = [&topic, &transforms, base, lidar_frame](std::int64_t stamp_ns) {
    const auto T_odometry_base = topic.poses.at(stamp_ns);
    const auto T_base_lidar = transforms.lookup(base, lidar_frame, stamp_ns);
    return T_odometry_base && T_base_lidar ? std::optional<Pose>(*T_odometry_base * *T_base_lidar)
                                           : std::nullopt;
  };
  if (is_swapped) {
    poses.inverted = [&topic, &transforms, base, lidar_frame](std::int64_t stamp_ns) {
      const auto T_base_odometry = topic.poses.at(stamp_ns);
      const auto T_base_lidar = transforms.lookup(base, lidar_frame, stamp_ns);
      return T_base_odometry && T_base_lidar
                 ? std::optional<Pose>(T_base_odometry->inverse() * *T_base_lidar)
                 : std::nullopt;
    };
  }
  poses.is_mounted = true;
  const bool is_rigid = transforms.is_rigid(base, lidar_frame);
  const auto T_base_lidar = transforms.lookup(base, lidar_frame, topic.poses.first_ns());
  if (is_rigid) poses.mount = T_base_lidar;
  poses.notes.push_back({chosen + "; LiDAR " + quoted(lidar_frame) + " in it: " +
                             (is_rigid && T_base_lidar ? extrinsic_text(*T_base_lidar) : "moving"),
                         false});
  return poses;
}

/// The frames that the LiDAR moves in.
std::vector<std::string> fixed_frames(const TransformTree& transforms, const std::string& lidar) {
  std::vector<std::string> frames;
  for (const std::string& frame : transforms.ancestors(lidar)) {
    if (transforms.moves(frame, lidar)) frames.push_back(frame);
  }
  return frames;
}

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text.empty() ? "none" : text;
}

/// Empty where there is none; throws where several fit.
std::string choose_fixed_frame(const TransformTree& transforms, const PoseWish& wish) {
  const auto frames = fixed_frames(transforms, wish.lidar_frame);
  if (!wish.fixed_frame.empty()) {
    const auto ancestors = transforms.ancestors(wish.lidar_frame);
    if (std::find(ancestors.begin(), ancestors.end(), wish.fixed_frame) != ancestors.end()) {
      return wish.fixed_frame;
    }
    throw DatasetError("the transforms give no pose of the LiDAR's frame " +
                       quoted(wish.lidar_frame) + " in " + quoted(wish.fixed_frame) +
                       "; there are: " + joined(frames));
  }
  // What drifts but never jumps comes first.
  for (const char* name : {"odom", "odometry", "map", "world"}) {
    if (std::find(frames.begin(), frames.end(), name) != frames.end()) return name;
  }
  if (frames.size() > 1) {
    throw DatasetError("the LiDAR's frame " + quoted(wish.lidar_frame) +
                       " moves in several frames: " + joined(frames) + "; choose one with --frame");
  }
  return frames.empty() ? std::string() : frames.front();
}

}  // namespace

std::string seconds_text(std::int64_t stamp_ns) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.3f",
                static_cast<double>(stamp_ns) / static_cast<double>(kNanosecondsPerSecond));
  return text.data();
}

void BagPoses::add(const PoseMessage& message, PoseTopic* topic, bool is_static,
                   std::int64_t log_ns) {
  if (topic == nullptr) {
    if (message.header.frame.empty() || message.child_frame.empty() || !message.pose) return;
    transforms.add(message.header.frame, message.child_frame, message.header.stamp_ns,
                   *message.pose, is_static);
    return;
  }
  if (!message.pose) {
    ++topic->invalid;
    return;
  }
  const auto [known, is_new] = topic->frames_index.try_emplace(
      {message.header.frame, message.child_frame}, topic->frames.size());
  if (is_new) topic->frames.push_back({message.header.frame, message.child_frame});
  ++topic->frames[known->second].poses;
  topic->recorded.push_back({message.header.stamp_ns, log_ns, *message.pose, known->second});
}

namespace {

/// Keeps the poses of one frame in another, those of which there are most.
void choose_frames(PoseTopic& topic) {
  if (topic.frames.empty()) return;
  const auto chosen =
      std::max_element(topic.frames.begin(), topic.frames.end(),
                       [](const PoseFrames& a, const PoseFrames& b) { return a.poses < b.poses; });
  const auto index = static_cast<std::size_t>(chosen - topic.frames.begin());
  topic.frame = chosen->frame;
  topic.child_frame = chosen->child_frame;
  std::erase_if(topic.recorded, [index](const auto& pose) { return pose.frames != index; });
  topic.left_out = std::move(topic.frames);
  topic.left_out.erase(topic.left_out.begin() + static_cast<std::ptrdiff_t>(index));
  topic.frames.clear();
  topic.frames_index.clear();
}

/// Poses by stamp, without those whose stamp is a glitch, by a clock without steps.
void order_poses(PoseTopic& topic) {
  for (std::size_t i = 0; i < topic.recorded.size(); ++i) {
    const PoseTopic::Recorded& recorded = topic.recorded[i];
    if (topic.stamps.is_glitch[i]) continue;
    topic.poses.add(topic.stamps.without_steps(i, recorded.stamp_ns), recorded.pose);
  }
  topic.poses.finish();
  std::vector<PoseTopic::Recorded>().swap(topic.recorded);
}

}  // namespace

void BagPoses::finish(RecordedStamps& scans) {
  for (auto& [number, topic] : topics) {
    choose_frames(topic);
    topic.stamps = check_stamps_of(topic.recorded);
    find_common_steps(topic.stamps, scans);
    order_poses(topic);
  }
  transforms.finish();
}

LidarPoses missing_poses() {
  LidarPoses none;
  none.description = "none";
  none.are_missing = true;
  none.at = [](std::int64_t /*stamp_ns*/) { return std::optional<Pose>(Pose()); };
  return none;
}

LidarPoses find_lidar_poses(const BagPoses& poses, const PoseWish& wish) {
  std::vector<const PoseTopic*> topics;
  for (const auto& [number, topic] : poses.topics) {
    if (!topic.poses.is_empty()) topics.push_back(&topic);
  }
  const bool has_odometry = topics.size() == 1 && topics.front()->is_odometry;
  const std::string frame =
      has_odometry ? std::string() : choose_fixed_frame(poses.transforms, wish);
  if (!frame.empty()) {
    if (wish.is_mounted_by_caller) {
      throw DatasetError("--extrinsic: its transforms give the poses of the LiDAR itself");
    }
    if (const auto two = poses.transforms.find_alternating(frame, wish.lidar_frame)) {
      fail_alternating(quoted(two->frame) + " in " + quoted(two->parent) + " of the transforms",
                       two->found);
    }
    LidarPoses found;
    found.description = "the transforms from " + quoted(wish.lidar_frame) + " to " + quoted(frame);
    found.notes.push_back({"poses: " + found.description, false});
    for (const auto& [number, topic] : poses.topics) {
      if (topic.poses.is_empty()) note_invalid(topic, found.notes);
    }
    const std::string lidar = wish.lidar_frame;
    const TransformTree& transforms = poses.transforms;
    found.at = [&transforms, frame, lidar](std::int64_t stamp_ns) {
      return transforms.lookup(frame, lidar, stamp_ns);
    };
    return found;
  }
  if (topics.size() == 1) {
    return from_topic(*topics.front(), poses.transforms, wish);
  }
  if (topics.size() > 1) {
    std::string list;
    for (const PoseTopic* topic : topics) {
      list += (list.empty() ? "" : ", ") + topic->description;
    }
    throw DatasetError("holds several topics of poses: " + list +
                       "; choose one with --odometry-topic");
  }
  LidarPoses none = missing_poses();
  for (const auto& [number, topic] : poses.topics) note_invalid(topic, none.notes);
  return none;
}

}  // namespace unimapper::datasets::bag
