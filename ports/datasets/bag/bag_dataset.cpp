// Scans and poses of a bag.
#include <algorithm>
#include <array>
#include <cstdio>
#include <optional>
#include <utility>

#include "ports/datasets/bag/bag_poses.hpp"
#include "ports/datasets/bag/message_source.hpp"
#include "ports/datasets/bag/messages.hpp"
#include "ports/datasets/bag/topic_choice.hpp"
#include "ports/datasets/files.hpp"
#include "ports/datasets/formats.hpp"
#include "ports/datasets/poses.hpp"

namespace unimapper::datasets {

namespace fs = std::filesystem;

namespace bag {

namespace {

/// A scan with a pose.
struct PosedScan {
  std::size_t number;  ///< among the messages of the topic
  std::int64_t stamp_ns;
  Pose T_odometry_lidar;
};

/// What the first walk through a bag collects.
struct Contents {
  struct ScanStamp {
    std::size_t number;
    std::int64_t stamp_ns;
  };
  std::vector<ScanStamp> scans;
  std::string lidar_frame;  ///< of the first scan
  std::size_t other_frames = 0;
  std::size_t without_stamp = 0;
  BagPoses poses;
  std::size_t unreadable = 0;
  std::string first_unreadable;
};

std::string count_text(std::size_t count, const std::string& what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

bool is_transforms(MessageKind kind) { return kind == MessageKind::kTransforms; }

/// Static transforms are published under a name of their own.
bool is_static_topic(const Topic& topic) { return topic.name.ends_with("tf_static"); }

class BagWalk {
 public:
  BagWalk(MessageSource& source, std::size_t scan_topic,
          const std::vector<std::size_t>& pose_topics, bool is_asked_for)
      : source_(source), scan_topic_(scan_topic) {
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
    for (const auto& [topic, poses] : contents_.poses.topics) topics.push_back(topic);
    for_each_message(source_, topics, [this](std::size_t topic, std::size_t number) {
      try {
        take(topic, number);
      } catch (const DatasetError& error) {
        if (contents_.unreadable++ == 0) {
          contents_.first_unreadable = source_.topics()[topic].name + ": " + error.what();
        }
      }
    });
    contents_.poses.finish();
    return std::move(contents_);
  }

 private:
  void take(std::size_t number_of_topic, std::size_t number) {
    const Topic& topic = source_.topics()[number_of_topic];
    const MessagePlace& place = source_.messages(number_of_topic)[number];
    if (number_of_topic == scan_topic_) {
      take_scan(decode_header(source_.read(place, kHeaderBytes), topic.serialization), number,
                place.log_time_ns);
      return;
    }
    const auto found = contents_.poses.topics.find(number_of_topic);
    PoseTopic* poses = found == contents_.poses.topics.end() ? nullptr : &found->second;
    for (const PoseMessage& message :
         decode_poses(source_.read(place), topic.serialization, kind_of(topic.type))) {
      contents_.poses.add(message, poses, is_static_topic(topic));
    }
  }

  void take_scan(const MessageHeader& header, std::size_t number, std::int64_t log_time_ns) {
    if (contents_.scans.empty()) contents_.lidar_frame = header.frame;
    if (header.frame != contents_.lidar_frame) ++contents_.other_frames;
    if (header.stamp_ns == 0) ++contents_.without_stamp;
    contents_.scans.push_back({number, header.stamp_ns != 0 ? header.stamp_ns : log_time_ns});
  }

  MessageSource& source_;
  std::size_t scan_topic_;
  Contents contents_;
};

/// Poses of a pose file that another program made from this bag: those of the LiDAR itself.
LidarPoses poses_of_file(const fs::path& file, PoseSeries& series) {
  const Trajectory trajectory = parse_trajectory(read_file(file), file);
  if (trajectory.stamps_ns.empty()) {
    fail(file, "has no stamps: scans of a bag take their poses by stamp (t x y z qx qy qz qw)");
  }
  for (std::size_t i = 0; i < trajectory.poses.size(); ++i) {
    series.add(trajectory.stamps_ns[i], trajectory.poses[i]);
  }
  series.finish();
  LidarPoses poses;
  poses.description = file.string();
  poses.covered_time =
      seconds_text(series.first_ns()) + " to " + seconds_text(series.last_ns()) + " s";
  poses.notes.push_back({"poses of the LiDAR: " + poses.description, false});
  poses.at = [&series](std::int64_t stamp_ns) { return series.at(stamp_ns); };
  return poses;
}

class BagDataset final : public Dataset {
 public:
  BagDataset(const fs::path& path, const OpenOptions& options)
      : path_(path), source_(open_messages(path)) {
    for (const std::string& warning : source_->warnings()) notes_.push_back({warning, true});
    try {
      open(options);
    } catch (const DatasetError& error) {
      fail(path_, error.what());
    }
  }

  [[nodiscard]] std::size_t scan_count() const override { return scans_.size(); }

  void read_scan(std::size_t i, Scan& scan) const override {
    const PosedScan& posed = scans_.at(i);
    try {
      decode_scan(message(posed.number), topic().serialization, kind_of(topic().type), layout_,
                  scan);
    } catch (const DatasetError& error) {
      fail(path_, topic().name + " message " + std::to_string(posed.number) + ": " + error.what());
    }
  }

  [[nodiscard]] const Pose& pose(std::size_t i) const override {
    return scans_.at(i).T_odometry_lidar;
  }
  [[nodiscard]] std::int64_t stamp_ns(std::size_t i) const override {
    return scans_.at(i).stamp_ns;
  }
  [[nodiscard]] std::string scan_name(std::size_t i) const override {
    std::array<char, 24> name;
    std::snprintf(name.data(), name.size(), "%06zu", scans_.at(i).number);
    return name.data();
  }
  [[nodiscard]] std::vector<std::uint32_t> labels(std::size_t /*i*/) const override { return {}; }
  [[nodiscard]] std::vector<Pose> ground_truth_poses() const override { return {}; }
  [[nodiscard]] std::vector<Note> notes() const override { return notes_; }
  [[nodiscard]] std::optional<Pose> pose_at(std::int64_t stamp_ns) const override {
    return lidar_poses_.at(stamp_ns);
  }

 private:
  [[nodiscard]] const Topic& topic() const { return source_->topics()[topic_]; }
  [[nodiscard]] std::string_view message(std::size_t number) const {
    return source_->read(source_->messages(topic_)[number]);
  }

  void open(const OpenOptions& options) {
    topic_ = choose_scan_topic(*source_, options.topic);
    const bool has_pose_file = !options.poses.empty();
    const bool only_transforms = options.odometry_topic.empty() && !options.frame.empty();
    std::vector<std::size_t> pose_topics;
    if (!has_pose_file && !only_transforms) {
      pose_topics = choose_pose_topics(*source_, options.odometry_topic);
    }
    Contents contents =
        BagWalk(*source_, topic_, pose_topics, !options.odometry_topic.empty()).walk();
    poses_ = std::move(contents.poses);
    note_contents(contents);
    if (contents.scans.empty()) {
      throw DatasetError("no message of " + describe(topic()) +
                         " can be read: " + contents.first_unreadable);
    }
    find_scan_layout(contents.scans);

    PoseWish wish;
    wish.lidar_frame = contents.lidar_frame;
    wish.fixed_frame = options.frame;
    wish.is_mounted_by_caller = !options.T_base_lidar.empty();
    wish.refuses_unknown_mounting = options.refuses_unknown_mounting;
    lidar_poses_ =
        has_pose_file ? poses_of_file(options.poses, file_poses_) : find_lidar_poses(poses_, wish);
    notes_.insert(notes_.end(), lidar_poses_.notes.begin(), lidar_poses_.notes.end());
    pose_scans(contents.scans);
  }

  void note_contents(const Contents& contents) {
    if (contents.unreadable > 0) {
      notes_.push_back(
          {count_text(contents.unreadable, "message") +
               " cannot be read and are left out; the first: " + contents.first_unreadable,
           true});
    }
    if (contents.other_frames > 0) {
      notes_.push_back({count_text(contents.other_frames, "scan") + " of " + topic().name +
                            " lie in another frame than the first, '" + contents.lidar_frame +
                            "': taken as if they lay in that",
                        true});
    }
    if (contents.without_stamp > 0) {
      notes_.push_back({count_text(contents.without_stamp, "scan") +
                            " without a stamp: the time of recording is taken",
                        true});
    }
    for (const std::string& frame : poses_.transforms.ambiguous_frames()) {
      notes_.push_back({"frame '" + frame + "' has several parents in the transforms: the first " +
                            "one is taken",
                        true});
    }
  }

  /// From the first of a few scans that shows the unit of time; those at the ends may be cut.
  void find_scan_layout(const std::vector<Contents::ScanStamp>& scans) {
    const std::size_t last = scans.size() - 1;
    const std::array<std::size_t, 5> tried = {last / 2, last / 4, last - last / 4, 0, last};
    std::string first_error;
    bool is_found = false;
    for (const std::size_t scan : tried) {
      try {
        layout_ =
            find_layout(message(scans[scan].number), topic().serialization, kind_of(topic().type));
        is_found = true;
        if (layout_.clock) break;
      } catch (const DatasetError& error) {
        if (first_error.empty()) first_error = error.what();
      }
    }
    if (!is_found) throw DatasetError(topic().name + ": " + first_error);
    notes_.push_back({"scans: " + describe(topic()) + ", fields " + layout_.description +
                          (layout_.clock ? "" : ", no time per point"),
                      false});
    if (layout_.clock && layout_.clock->zero == PointClock::Zero::kOwn) {
      notes_.push_back(
          {"the points' times are of another clock than the scans' stamps: the first "
           "point is taken to be measured at the stamp",
           true});
    }
  }

  void pose_scans(std::vector<Contents::ScanStamp> scans) {
    std::stable_sort(scans.begin(), scans.end(),
                     [](const auto& a, const auto& b) { return a.stamp_ns < b.stamp_ns; });
    std::size_t repeated = 0;
    std::size_t before = 0;
    std::size_t after = 0;
    for (std::size_t i = 0; i < scans.size(); ++i) {
      if (i > 0 && scans[i].stamp_ns == scans[i - 1].stamp_ns) {
        ++repeated;
        continue;
      }
      const auto pose = lidar_poses_.at(scans[i].stamp_ns);
      if (pose) {
        scans_.push_back({scans[i].number, scans[i].stamp_ns, *pose});
        after = 0;
      } else {
        ++(scans_.empty() ? before : after);
      }
    }
    const std::size_t within = scans.size() - repeated - before - after - scans_.size();
    if (scans_.empty()) {
      throw DatasetError(
          "none of its " + count_text(scans.size(), "scan") + " (" +
          seconds_text(scans.front().stamp_ns) + " to " + seconds_text(scans.back().stamp_ns) +
          " s) has a pose in " + lidar_poses_.description +
          (lidar_poses_.covered_time.empty() ? "" : " (" + lidar_poses_.covered_time + ")") +
          ": are their clocks the same?");
    }
    note_missing(before, within, after, scans.size());
    if (repeated > 0) {
      notes_.push_back(
          {count_text(repeated, "scan") + " with the stamp of another: left out", true});
    }
  }

  void note_missing(std::size_t before, std::size_t within, std::size_t after, std::size_t scans) {
    const std::size_t missing = before + within + after;
    if (missing == 0) return;
    constexpr std::size_t kWarningShare = 10;
    notes_.push_back({count_text(missing, "scan") + " of " + std::to_string(scans) +
                          " without a pose left out: " + std::to_string(before) +
                          " before the first pose, " + std::to_string(after) +
                          " after the last one, " + std::to_string(within) +
                          " where poses are more than 0.5 s apart",
                      within > 0 || missing * kWarningShare > scans});
  }

  fs::path path_;
  std::unique_ptr<MessageSource> source_;
  std::size_t topic_ = 0;
  ScanLayout layout_;
  BagPoses poses_;
  PoseSeries file_poses_;
  LidarPoses lidar_poses_;
  std::vector<PosedScan> scans_;
  std::vector<Note> notes_;
};

}  // namespace

}  // namespace bag

bool recognises_bag(const fs::path& path) { return bag::holds_messages(path); }

std::unique_ptr<Dataset> open_bag(const fs::path& path, const OpenOptions& options) {
  return std::make_unique<bag::BagDataset>(path, options);
}

}  // namespace unimapper::datasets
