#include "ports/datasets/bag/bag_walk.hpp"

#include <algorithm>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include "ports/datasets/bag/messages.hpp"
#include "ports/datasets/bag/topic_choice.hpp"

namespace unimapper::datasets::bag {

std::string count_text(std::size_t count, const std::string& what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

namespace {

bool is_transforms(MessageKind kind) { return kind == MessageKind::kTransforms; }

/// Static transforms are published under a name of their own.
bool is_static_topic(const Topic& topic) { return topic.name.ends_with("tf_static"); }

class BagWalk {
 public:
  BagWalk(MessageSource& source, std::size_t scan_topic,
          const std::vector<std::size_t>& pose_topics, bool is_asked_for, std::string wanted_lidar)
      : source_(source), scan_topic_(scan_topic), wanted_lidar_(std::move(wanted_lidar)) {
    for (const std::size_t topic : pose_topics) {
      if (is_transforms(kind_of(source.topics()[topic].type))) continue;
      PoseTopic& poses = contents_.poses.topics[topic];
      poses.description = describe(source.topics()[topic]);
      poses.is_odometry =
          is_asked_for || kind_of(source.topics()[topic].type) == MessageKind::kOdometry;
    }
  }

  Contents walk() {
    std::vector<std::size_t> topics = find_topics(source_, &is_transforms);
    topics.push_back(scan_topic_);
    for (const std::size_t topic :
         find_topics(source_, [](MessageKind kind) { return kind == MessageKind::kFix; })) {
      contents_.fixes[topic].description = describe(source_.topics()[topic]);
      topics.push_back(topic);
    }
    for (const auto& [topic, poses] : contents_.poses.topics) {
      if (kind_of(source_.topics()[topic].type) == MessageKind::kPath) {
        take_path(topic);
      } else {
        topics.push_back(topic);
      }
    }
    for_each_message(source_, topics, [this](std::size_t topic, std::size_t number) {
      try {
        take(topic, number);
      } catch (const DatasetError& error) {
        count_unreadable(topic, number, error);
      }
    });
    choose_lidar();
    contents_.stamps = check_stamps_of(contents_.scans);
    contents_.poses.finish(contents_.stamps);
    return std::move(contents_);
  }

 private:
  void take(std::size_t number_of_topic, std::size_t number) {
    const Topic& topic = source_.topics()[number_of_topic];
    const MessagePlace& place = source_.messages(number_of_topic)[number];
    if (number_of_topic == scan_topic_) {
      take_scan(source_.read(place, kHeaderBytes), number, place.log_time_ns);
      return;
    }
    if (const auto fixes = contents_.fixes.find(number_of_topic); fixes != contents_.fixes.end()) {
      fixes->second.recorded.push_back(decode_fix(source_.read(place), topic.serialization));
      return;
    }
    const auto found = contents_.poses.topics.find(number_of_topic);
    PoseTopic* poses = found == contents_.poses.topics.end() ? nullptr : &found->second;
    for (const PoseMessage& message :
         decode_poses(source_.read(place), topic.serialization, kind_of(topic.type))) {
      contents_.poses.add(message, poses, is_static_topic(topic), place.log_time_ns);
    }
  }

  /// A path holds all poses so far, or the last ones: its last message counts, and of those before
  /// it what they reach further back.
  void take_path(std::size_t topic) {
    const auto& places = source_.messages(topic);
    std::vector<PoseMessage> poses;
    std::int64_t first_ns = INT64_MAX;
    std::optional<double> lag_ns;  // of recording; the recorder may have another clock
    for (std::size_t i = places.size(); i-- > 0;) {
      // The poses of later messages are known.
      const auto before_ns = i > 0 ? static_cast<double>(places[i - 1].log_time_ns) : 0.0;
      if (i > 0 && lag_ns && before_ns - *lag_ns >= static_cast<double>(first_ns)) continue;
      std::vector<PoseMessage> path;
      try {
        path = decode_poses(source_.read(places[i]), source_.topics()[topic].serialization,
                            MessageKind::kPath);
      } catch (const DatasetError& error) {
        count_unreadable(topic, i, error);
      }
      for (const PoseMessage& pose : path) {
        const double lag =
            static_cast<double>(places[i].log_time_ns) - static_cast<double>(pose.header.stamp_ns);
        // That of the newest pose.
        if (first_ns == INT64_MAX) lag_ns = std::min(lag_ns.value_or(lag), lag);
      }
      std::erase_if(path, [&](const auto& pose) { return pose.header.stamp_ns >= first_ns; });
      poses.insert(poses.end(), path.begin(), path.end());
      for (const PoseMessage& pose : path) first_ns = std::min(first_ns, pose.header.stamp_ns);
    }
    std::stable_sort(poses.begin(), poses.end(), [](const PoseMessage& a, const PoseMessage& b) {
      return a.header.stamp_ns < b.header.stamp_ns;
    });
    PoseTopic& taken = contents_.poses.topics.at(topic);
    taken.is_path = true;
    for (const PoseMessage& pose : poses) {
      contents_.poses.add(pose, &taken, false, pose.header.stamp_ns);
    }
  }

  void count_unreadable(std::size_t topic, std::size_t number, const DatasetError& error) {
    if (topic == scan_topic_) ++contents_.unreadable_scans;
    if (contents_.unreadable++ > 0) return;
    contents_.first_unreadable =
        source_.topics()[topic].name + " message " + std::to_string(number) + ": " + error.what();
  }

  void take_scan(std::string_view bytes, std::size_t number, std::int64_t log_time_ns) {
    const Topic& topic = source_.topics()[scan_topic_];
    const MessageHeader header = decode_header(bytes, topic.serialization);
    const std::uint8_t lidar = decode_lidar_number(bytes, topic.serialization, kind_of(topic.type));
    auto& lidars = contents_.lidars;
    const auto found = std::find_if(lidars.begin(), lidars.end(), [&](const auto& known) {
      return known.frame == header.frame && known.number == lidar;
    });
    const auto index = static_cast<std::size_t>(found - lidars.begin());
    if (found == lidars.end()) lidars.push_back({header.frame, lidar, 0});
    ++lidars[index].scans;
    contents_.scans.push_back(
        {number, header.stamp_ns != 0 ? header.stamp_ns : log_time_ns, log_time_ns, index});
    if (header.stamp_ns == 0) ++contents_.without_stamp;
  }

  /// Keeps the scans of one LiDAR: the one that is wanted, or the only one.
  void choose_lidar() {
    const auto& lidars = contents_.lidars;
    std::vector<std::size_t> order(lidars.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    // The others are added to the one with most scans.
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return lidars[a].scans > lidars[b].scans;
    });
    std::vector<std::string> names;
    std::string list;
    std::vector<bool> is_chosen(lidars.size());
    for (const std::size_t index : order) {
      const Contents::Lidar& lidar = lidars[index];
      const auto of_frame = std::count_if(lidars.begin(), lidars.end(), [&](const auto& other) {
        return other.frame == lidar.frame;
      });
      const std::string name =
          lidar.frame + (of_frame > 1 ? "#" + std::to_string(lidar.number) : std::string());
      is_chosen[index] = wanted_lidar_.empty() || name == wanted_lidar_;
      list +=
          (list.empty() ? "'" : ", '") + name + "' (" + count_text(lidar.scans, "message") + ")";
      // A message that does not say is of the others' LiDAR.
      if (lidar.frame.empty() && static_cast<std::size_t>(of_frame) < lidars.size()) continue;
      names.push_back(source_.topics()[scan_topic_].name + "@" + name);
    }
    if (!wanted_lidar_.empty() &&
        std::find(is_chosen.begin(), is_chosen.end(), true) == is_chosen.end()) {
      throw DatasetError(source_.topics()[scan_topic_].name + " holds no scans of '" +
                         wanted_lidar_ + "'; there are " + list);
    }
    if (wanted_lidar_.empty() && names.size() > 1) fail_several(names, list);
    std::vector<Contents::ScanStamp> scans;
    for (const Contents::ScanStamp& scan : contents_.scans) {
      if (!is_chosen[scan.lidar]) continue;
      const std::string& frame = lidars[scan.lidar].frame;
      if (!frame.empty()) contents_.lidar_frame = frame;
      contents_.without_frame += frame.empty() ? 1 : 0;
      scans.push_back(scan);
    }
    contents_.scans = std::move(scans);
  }

  [[noreturn]] void fail_several(const std::vector<std::string>& names,
                                 const std::string& list) const {
    std::string all;
    for (const std::string& name : names) all += (all.empty() ? "" : ",") + name;
    const std::string message = source_.topics()[scan_topic_].name +
                                " holds the scans of several LiDARs, or of one whose "
                                "frame changes its name: " +
                                list +
                                "; let one LiDAR keep one name, or choose one with --topic " +
                                names.front() + ", or all as one with --topic " + all +
                                " and --extrinsic x,y,z,roll,pitch,yaw once for each";
    std::set<std::string> frames;
    for (const Contents::Lidar& lidar : contents_.lidars) frames.insert(lidar.frame);
    frames.erase(std::string());
    if (frames.size() < names.size()) {
      throw DatasetError(message + "; they share a frame, so transforms do not tell where each is");
    }
    throw SeveralLidarsError(message, names);
  }

  MessageSource& source_;
  std::size_t scan_topic_;
  std::string wanted_lidar_;  // empty: there is one only
  Contents contents_;
};

}  // namespace

Contents walk_bag(MessageSource& source, std::size_t scan_topic,
                  const std::vector<std::size_t>& pose_topics, bool is_asked_for,
                  std::string wanted_lidar) {
  return BagWalk(source, scan_topic, pose_topics, is_asked_for, std::move(wanted_lidar)).walk();
}

}  // namespace unimapper::datasets::bag
