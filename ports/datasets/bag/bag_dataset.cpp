// Scans and poses of a bag.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

#include "ports/datasets/bag/bag_poses.hpp"
#include "ports/datasets/bag/message_source.hpp"
#include "ports/datasets/bag/messages.hpp"
#include "ports/datasets/bag/topic_choice.hpp"
#include "ports/datasets/files.hpp"
#include "ports/datasets/formats.hpp"
#include "ports/datasets/pose_track.hpp"
#include "ports/datasets/poses.hpp"
#include "ports/datasets/sharpness.hpp"
#include "ports/datasets/text_encoding.hpp"

namespace unimapper::datasets {

namespace fs = std::filesystem;

namespace bag {

namespace {

/// A scan with a pose.
struct PosedScan {
  std::size_t number;   ///< among the messages of the topic
  std::int64_t log_ns;  ///< when it was recorded
  std::int64_t stamp_ns;
  Pose T_odometry_lidar;
};

/// What the first walk through a bag collects.
struct Contents {
  struct ScanStamp {
    std::size_t number;
    std::int64_t stamp_ns;
    std::int64_t log_ns;
    std::size_t lidar;  ///< index of `lidars`
  };
  /// What tells the LiDARs of one topic apart.
  struct Lidar {
    std::string frame;
    std::uint8_t number = 0;  ///< that Livox gives it
    std::size_t scans = 0;
  };
  std::vector<Lidar> lidars;
  std::vector<ScanStamp> scans;
  std::string lidar_frame;        ///< of the scans
  std::size_t without_frame = 0;  ///< scans
  std::size_t without_stamp = 0;
  RecordedStamps stamps;  ///< of the scans
  BagPoses poses;
  std::size_t unreadable = 0;
  std::size_t unreadable_scans = 0;  ///< unreadable messages of the scans' topic
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

/// Poses of a pose file that another program made from this bag: those of the LiDAR itself.
LidarPoses poses_of_file(const fs::path& file, PoseSeries& series) {
  const Trajectory trajectory = parse_trajectory(read_text(file), file);
  if (trajectory.stamps_ns.empty()) {
    fail(file, "has no stamps: scans of a bag take their poses by stamp (t x y z qx qy qz qw)");
  }
  for (std::size_t i = 0; i < trajectory.poses.size(); ++i) {
    series.add(trajectory.stamps_ns[i], trajectory.poses[i]);
  }
  series.finish();
  if (const PoseAlternation found = series.alternation(); found.is_of_two()) {
    fail(file, "its poses " + alternation_text(found) + "; are those of two programs in it?");
  }
  LidarPoses poses;
  poses.description = file.string();
  poses.covered_time =
      seconds_text(series.first_ns()) + " to " + seconds_text(series.last_ns()) + " s";
  poses.first_ns = series.first_ns();
  poses.last_ns = series.last_ns();
  poses.apart = poses_apart_text(series.stamps_ns());
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
    } catch (const SeveralLidarsError& error) {
      throw SeveralLidarsError(path_.string() + ": " + error.what(), error.topics());
    } catch (const DatasetError& error) {
      fail(path_, error.what());
    }
  }

  [[nodiscard]] std::size_t scan_count() const override { return scans_.size(); }

  void read_scan(std::size_t i, Scan& scan) const override {
    const PosedScan& posed = scans_.at(i);
    try {
      decode_scan(message(posed.number), topic().serialization, kind_of(topic().type), layout_,
                  scan, posed.log_ns);
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
  [[nodiscard]] bool is_mounted_by_recording() const override { return lidar_poses_.is_mounted; }
  [[nodiscard]] bool has_poses() const override { return !lidar_poses_.are_missing; }
  [[nodiscard]] std::optional<Pose> pose_at(std::int64_t stamp_ns) const override {
    return lidar_poses_.at(stamp_ns);
  }

 private:
  [[nodiscard]] const Topic& topic() const { return source_->topics()[topic_]; }
  [[nodiscard]] std::string_view message(std::size_t number) const {
    return source_->read(source_->messages(topic_)[number]);
  }

  void open(const OpenOptions& options) {
    // ROS has no '@' in names of topics.
    const std::size_t at = std::min(options.topic.find('@'), options.topic.size());
    topic_ = choose_scan_topic(*source_, options.topic.substr(0, at));
    lidar_ = options.topic.substr(std::min(at + 1, options.topic.size()));
    const bool has_pose_file = !options.poses.empty();
    const bool only_transforms = options.odometry_topic.empty() && !options.frame.empty();
    std::vector<std::size_t> pose_topics;
    if (!has_pose_file && !only_transforms && !options.own_odometry) {
      pose_topics = choose_pose_topics(*source_, options.odometry_topic);
    }
    Contents contents =
        BagWalk(*source_, topic_, pose_topics, !options.odometry_topic.empty(), lidar_).walk();
    poses_ = std::move(contents.poses);
    note_contents(contents);
    constexpr std::size_t kMostShare = 10;
    if (contents.scans.empty() || kMostShare * contents.unreadable_scans >=
                                      contents.scans.size() + contents.unreadable_scans) {
      throw DatasetError(std::to_string(contents.unreadable_scans) + " messages of " +
                         describe(topic()) +
                         " cannot be read; the first: " + contents.first_unreadable);
    }
    find_scan_layout(contents.scans);

    PoseWish wish;
    wish.lidar_frame = contents.lidar_frame;
    wish.fixed_frame = options.frame;
    wish.is_mounted_by_caller = !options.T_base_lidar.empty();
    wish.refuses_unknown_mounting = options.refuses_unknown_mounting;
    lidar_poses_ = options.own_odometry ? missing_poses()
                   : has_pose_file      ? poses_of_file(options.poses, file_poses_)
                                        : find_lidar_poses(poses_, wish);
    notes_.insert(notes_.end(), lidar_poses_.notes.begin(), lidar_poses_.notes.end());
    apply_stamps(contents);
    if (lidar_poses_.inverted) choose_reading(contents.scans);
    if (lidar_poses_.mount) check_mount(contents.scans, *lidar_poses_.mount);
    pose_scans(std::move(contents.scans));
  }

  void note_contents(const Contents& contents) {
    if (contents.unreadable > 0) {
      notes_.push_back(
          {count_text(contents.unreadable, "message") +
               " cannot be read and are left out; the first: " + contents.first_unreadable,
           true});
    }
    if (contents.without_frame > 0 && !contents.lidar_frame.empty()) {
      notes_.push_back({count_text(contents.without_frame, "scan") + " of " + topic().name +
                            " without a frame: taken as if they lay in '" + contents.lidar_frame +
                            "'",
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

  /// From a few scans; those at the ends may be cut. The first that shows the unit of time counts.
  void find_scan_layout(const std::vector<Contents::ScanStamp>& scans) {
    const std::size_t last = scans.size() - 1;
    const std::array<std::size_t, 5> tried = {last / 2, last / 4, last - last / 4, 0, last};
    std::string first_error;
    std::vector<ScanLayout> layouts;
    for (const std::size_t scan : tried) {
      try {
        layouts.push_back(find_layout(message(scans[scan].number), topic().serialization,
                                      kind_of(topic().type), scans[scan].log_ns));
      } catch (const DatasetError& error) {
        if (first_error.empty()) first_error = error.what();
      }
    }
    if (layouts.empty()) throw DatasetError(topic().name + ": " + first_error);
    const auto with_clock = std::find_if(layouts.begin(), layouts.end(),
                                         [](const auto& layout) { return layout.clock; });
    const auto with_fields = std::find_if(layouts.begin(), layouts.end(), [](const auto& layout) {
      return !layout.description.empty();
    });
    layout_ = with_clock != layouts.end()    ? *with_clock
              : with_fields != layouts.end() ? *with_fields
                                             : layouts.front();
    for (const ScanLayout& other : layouts) {
      if (!layout_.clock || !other.clock || layout_.clock->zero != PointClock::Zero::kStamp ||
          other.clock->seconds_per_unit != layout_.clock->seconds_per_unit) {
        continue;
      }
      // Times that begin anew in no scan count from something else than its stamp.
      const bool begins_elsewhere =
          std::abs(other.times.least - layout_.times.least) > layout_.times.span();
      if (begins_elsewhere) layout_.clock->zero = PointClock::Zero::kOwn;
    }
    const char* without = layout_.has_time_field
                              ? ", times all the same or of no known unit: no time per point"
                              : ", no time per point";
    notes_.push_back({"scans: " + describe(topic()) +
                          (lidar_.empty() ? std::string() : ", those of '" + lidar_ + "'") +
                          ", fields " + layout_.description + (layout_.clock ? "" : without),
                      false});
    if (layout_.clock && layout_.clock->zero == PointClock::Zero::kOwn) {
      notes_.push_back(
          {"the points' times are of another clock than the scans' stamps: the first "
           "point is taken to be measured at the stamp",
           true});
    }
  }

  /// Leaves out scans whose stamp is a glitch; stamps are by the clock of the poses.
  void apply_stamps(Contents& contents) {
    // Transforms and poses of a file keep their own stamps, with every step.
    if (!lidar_poses_.is_of_topic) contents.stamps.steps.clear();
    RecordedStamps by_message = contents.stamps;
    for (ClockStep& step : by_message.steps) step.first = contents.scans[step.first].number;
    if (by_message.glitches > 0) {
      by_message.first_glitch = contents.scans[by_message.first_glitch].number;
    }
    note_stamps(by_message, "message", describe(topic()), notes_);
    std::vector<Contents::ScanStamp> scans;
    for (std::size_t i = 0; i < contents.scans.size(); ++i) {
      if (contents.stamps.is_glitch[i]) continue;
      scans.push_back(contents.scans[i]);
      scans.back().stamp_ns = contents.stamps.without_steps(i, scans.back().stamp_ns);
    }
    contents.scans = std::move(scans);
  }

  /// Of poses whose frames are named the wrong way round: are their values so, too?
  void choose_reading(const std::vector<Contents::ScanStamp>& scans) {
    const double as_given = thickness_of_surfaces(scans, lidar_poses_.at);
    const double inverted = thickness_of_surfaces(scans, lidar_poses_.inverted);
    if (inverted < as_given) lidar_poses_.at = lidar_poses_.inverted;
    const char* outcome =
        inverted < as_given   ? "poses are inverted, by which the surfaces are thinner"
        : as_given < inverted ? "poses are taken as they are, by which the surfaces are thinner "
                                "than by inverted ones"
                              : "the scans do not tell whether poses are inverted, too: taken as "
                                "they are";
    notes_.push_back({"the frames of " + lidar_poses_.description +
                          " are named the wrong way round: the LiDAR is fixed to its parent; " +
                          outcome,
                      true, true});
  }

  /// Is the transform to the LiDAR the inverse of what it says?
  void check_mount(const std::vector<Contents::ScanStamp>& scans, const Pose& T_base_lidar) {
    const Pose twice = T_base_lidar * T_base_lidar;
    constexpr double kLeast_m = 0.4;
    constexpr double kLeast_rad = 2.0 / kDegreesPerRadian;
    if (twice.translation.norm() < kLeast_m && rotation_angle(twice.rotation) < kLeast_rad) return;
    // Logarithms; a mount of 3 degrees was thinner by 0.34 than its inverse.
    constexpr double kClearly = 0.1;
    constexpr std::size_t kMostPoints = 4000;
    const auto inverted = [&](std::int64_t stamp_ns) {
      const auto pose = lidar_poses_.at(stamp_ns);
      return pose ? std::optional<Pose>(*pose * twice.inverse()) : std::nullopt;
    };
    const double as_given = thickness_of_surfaces(scans, lidar_poses_.at, kMostPoints) / 3.0;
    const double otherwise = thickness_of_surfaces(scans, inverted, kMostPoints) / 3.0;
    if (otherwise > as_given - kClearly) return;
    notes_.push_back({"the transform to the LiDAR looks inverted: by its inverse surfaces are " +
                          std::to_string(static_cast<int>(
                              std::lround(100.0 * (1.0 - std::exp(otherwise - as_given))))) +
                          " % thinner; exchange its parent and child, or give --extrinsic",
                      true, true});
  }

  /// Logarithm, summed over three windows of scans; of about `most_points` of every second one,
  /// where that is given.
  [[nodiscard]] double thickness_of_surfaces(
      const std::vector<Contents::ScanStamp>& scans,
      const std::function<std::optional<Pose>(std::int64_t)>& pose_at,
      std::size_t most_points = SIZE_MAX) const {
    constexpr std::size_t kScans = 15;
    double sum = 0.0;
    for (const std::size_t quarter : {1U, 2U, 3U}) {
      SurfaceThickness surfaces;
      const std::size_t first = scans.size() * quarter / 4;
      const std::size_t apart = most_points == SIZE_MAX ? 1 : 2;
      for (std::size_t i = first; i < std::min(first + kScans, scans.size()); i += apart) {
        const auto T_odometry_lidar = pose_at(scans[i].stamp_ns);
        if (!T_odometry_lidar) continue;
        Scan scan;
        try {
          decode_scan(message(scans[i].number), topic().serialization, kind_of(topic().type),
                      layout_, scan, scans[i].log_ns);
        } catch (const DatasetError&) {
          continue;  // counted where it is mapped
        }
        surfaces.begin_scan();
        const std::size_t step = 1 + scan.points.size() / most_points;
        for (std::size_t k = i % step; k < scan.points.size(); k += step) {
          const Scan::Point& p = scan.points[k];
          const Eigen::Vector3d point(p.x, p.y, p.z);
          constexpr double kFar_m = 40.0;
          if (point.norm() < kFar_m) surfaces.add(*T_odometry_lidar * point);
        }
      }
      sum += surfaces.log_thickness();
    }
    return sum;
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
        scans_.push_back({scans[i].number, scans[i].log_ns, scans[i].stamp_ns, *pose});
        after = 0;
      } else {
        ++(scans_.empty() ? before : after);
      }
    }
    const std::size_t within = scans.size() - repeated - before - after - scans_.size();
    require_dense_poses(scans);
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

  /// Throws where most scans lie between poses that are too far apart.
  void require_dense_poses(const std::vector<Contents::ScanStamp>& scans) const {
    if (lidar_poses_.apart.empty()) return;
    const auto covered = static_cast<std::size_t>(
        std::count_if(scans.begin(), scans.end(), [this](const auto& scan) {
          return scan.stamp_ns > lidar_poses_.first_ns && scan.stamp_ns < lidar_poses_.last_ns;
        }));
    const std::size_t between = covered - std::min(covered, scans_.size());
    if (2 * between <= scans.size()) return;
    throw DatasetError(lidar_poses_.description + ": " + lidar_poses_.apart + ": " +
                       std::to_string(between) + " of " + count_text(scans.size(), "scan") +
                       " lie between poses farther apart; " + remedy_for_sparse_poses());
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
  std::string lidar_;  // of several on the topic; empty: there is one only
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
