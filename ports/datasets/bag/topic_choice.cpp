#include "ports/datasets/bag/topic_choice.hpp"

#include <algorithm>

namespace unimapper::datasets::bag {

namespace {

MessageKind kind_of_topic(const MessageSource& source, std::size_t topic) {
  return kind_of(source.topics()[topic].type);
}

std::string list_topics(const MessageSource& source, const std::vector<std::size_t>& topics) {
  std::string list;
  for (const std::size_t topic : topics) {
    list += (list.empty() ? "" : ", ") + describe(source.topics()[topic]);
  }
  return list.empty() ? "none" : list;
}

std::string list_all_topics(const MessageSource& source) {
  std::vector<std::size_t> all(source.topics().size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
  return list_topics(source, all);
}

/// A robot's name for a topic may come without the leading slash.
std::optional<std::size_t> find_topic(const MessageSource& source, const std::string& name) {
  const auto& topics = source.topics();
  for (std::size_t i = 0; i < topics.size(); ++i) {
    if (topics[i].name == name || topics[i].name == "/" + name) return i;
  }
  return std::nullopt;
}

/// Raw data of a LiDAR that only its driver understands.
bool is_packet(const Topic& topic) {
  return topic.type.find("Packet") != std::string::npos ||
         topic.type.find("VelodyneScan") != std::string::npos;
}

bool is_path(MessageKind kind) { return kind == MessageKind::kPath; }
bool is_odometry(MessageKind kind) { return kind == MessageKind::kOdometry; }

}  // namespace

std::string describe(const Topic& topic) {
  return topic.name + " (" + (topic.type.empty() ? "unknown type" : topic.type) + ", " +
         std::to_string(topic.message_count) +
         (topic.message_count == 1 ? " message)" : " messages)");
}

std::vector<std::size_t> find_topics(const MessageSource& source, bool (*is_wanted)(MessageKind)) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < source.topics().size(); ++i) {
    if (!source.messages(i).empty() && is_wanted(kind_of_topic(source, i))) found.push_back(i);
  }
  return found;
}

void fail_ambiguous(const MessageSource& source, const std::vector<std::size_t>& topics,
                    const std::string& what, const std::string& option) {
  throw DatasetError("holds several topics of " + what + ": " + list_topics(source, topics) +
                     "; choose one with " + option);
}

std::size_t choose_scan_topic(const MessageSource& source, const std::string& wanted) {
  const std::vector<std::size_t> scans = find_topics(source, &is_scan);
  if (!wanted.empty()) {
    const auto topic = find_topic(source, wanted);
    if (topic && std::find(scans.begin(), scans.end(), *topic) != scans.end()) return *topic;
    throw DatasetError((topic ? describe(source.topics()[*topic]) + " holds no scans"
                              : "holds no topic '" + wanted + "'") +
                       "; topics of scans: " + list_topics(source, scans));
  }
  if (scans.size() > 1) {
    std::string all;
    for (const std::size_t topic : scans) {
      all += (all.empty() ? "" : ",") + source.topics()[topic].name;
    }
    fail_ambiguous(source, scans, "scans",
                   "--topic, or take LiDARs of one robot as one: --topic " + all);
  }
  if (scans.size() == 1) return scans.front();
  const auto& topics = source.topics();
  const bool has_packets = std::any_of(topics.begin(), topics.end(), &is_packet);
  throw DatasetError(
      "holds no scans (sensor_msgs/PointCloud2 or livox_ros_driver2/CustomMsg)" +
      std::string(has_packets ? " but a LiDAR's raw packets: replay it through the LiDAR's driver "
                                "and record the points"
                              : "") +
      "; its topics: " + list_all_topics(source));
}

std::vector<std::size_t> choose_pose_topics(const MessageSource& source,
                                            const std::string& wanted) {
  if (!wanted.empty()) {
    const auto topic = find_topic(source, wanted);
    if (topic && !source.messages(*topic).empty()) {
      const MessageKind kind = kind_of_topic(source, *topic);
      if (is_pose(kind) || is_path(kind) || kind == MessageKind::kTransforms) return {*topic};
    }
    std::vector<std::size_t> fitting = find_topics(source, &is_pose);
    const auto transforms =
        find_topics(source, [](MessageKind kind) { return kind == MessageKind::kTransforms; });
    fitting.insert(fitting.end(), transforms.begin(), transforms.end());
    const std::vector<std::size_t> paths = find_topics(source, &is_path);
    fitting.insert(fitting.end(), paths.begin(), paths.end());
    throw DatasetError((topic ? describe(source.topics()[*topic]) + " holds no poses"
                              : "holds no topic '" + wanted + "'") +
                       "; topics of poses: " + list_topics(source, fitting));
  }
  std::vector<std::size_t> odometry = find_topics(source, &is_odometry);
  if (odometry.size() > 1) fail_ambiguous(source, odometry, "odometry", "--odometry-topic");
  if (!odometry.empty()) return odometry;
  const std::vector<std::size_t> poses = find_topics(source, &is_pose);
  return poses.empty() ? find_topics(source, &is_path) : poses;
}

std::vector<std::size_t> choose_imu_topics(const MessageSource& source, const std::string& wanted) {
  std::vector<std::size_t> imus =
      find_topics(source, [](MessageKind kind) { return kind == MessageKind::kImu; });
  if (wanted.empty()) return imus;
  const auto topic = find_topic(source, wanted);
  if (topic && std::find(imus.begin(), imus.end(), *topic) != imus.end()) return {*topic};
  throw DatasetError((topic ? describe(source.topics()[*topic]) + " holds no sensor_msgs/Imu"
                            : "holds no topic '" + wanted + "'") +
                     "; topics of sensor_msgs/Imu: " + list_topics(source, imus));
}

}  // namespace unimapper::datasets::bag
