// Scans and poses of a bag.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <utility>

#include "ports/datasets/bag/bag_gyroscope.hpp"
#include "ports/datasets/bag/bag_poses.hpp"
#include "ports/datasets/bag/bag_walk.hpp"
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
  if (const std::size_t left_out = trajectory.not_finite + series.repeated(); left_out > 0) {
    poses.notes.push_back({poses.description + ": " + count_text(left_out, "pose") +
                               " not finite, or with the stamp of another one, left out",
                           true});
  }
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
      // What is damaged may be why something is missing.
      std::string text = error.what();
      for (const std::string& warning : source_->warnings()) text += "; " + warning;
      fail(path_, text);
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
  [[nodiscard]] std::vector<Fix> fixes() const override { return fixes_; }
  [[nodiscard]] RecordedGyroscope gyroscope() const override {
    try {
      return read_gyroscope(*source_, poses_.transforms, imu_);
    } catch (const DatasetError& error) {
      fail(path_, error.what());
    }
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
        walk_bag(*source_, topic_, pose_topics, !options.odometry_topic.empty(), lidar_);
    poses_ = std::move(contents.poses);
    imu_ = {options.imu_topic, topic().name, contents.lidar_frame};
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
    take_fixes(contents);
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
    const std::string without =
        layout_.has_time_field ? ", times all the same or of no known unit: no time per point"
                               : ", no time per point (its fields are" + layout_.all_fields + ")";
    notes_.push_back({"scans: " + describe(topic()) +
                          (lidar_.empty() ? std::string() : ", those of '" + lidar_ + "'") +
                          ", fields " + layout_.description +
                          (layout_.clock ? std::string() : without),
                      false});
    if (layout_.are_bytes_swapped) {
      notes_.push_back({"the points of " + topic().name +
                            " have their bytes in the other order than is_bigendian says: read in "
                            "the order that gives distances",
                        true});
    }
    constexpr double kUnread = 0.1;
    if (layout_.unread_share > kUnread) {
      notes_.push_back({std::to_string(static_cast<int>(100.0 * layout_.unread_share)) +
                            " % of the bytes of a message of " + topic().name +
                            " are of no point and are not read: are its width, height and "
                            "row_step right?",
                        true});
    }
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

  void take_fixes(const Contents& contents) {
    fixes_ = choose_fixes(contents.fixes, poses_.transforms, contents.lidar_frame, notes_);
    if (fixes_.empty() || contents.stamps.steps.empty()) return;
    notes_.push_back(
        {"the clock of the scans steps, so known positions are left out: by which clock they are "
         "is not known",
         true});
    fixes_.clear();
  }

  /// Of poses whose frames are named the wrong way round: are their values so, too?
  void choose_reading(const std::vector<Contents::ScanStamp>& scans) {
    const auto [as_given, inverted] = thickness_of_surfaces(scans, lidar_poses_.inverted);
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
    const auto [as_given, otherwise] = thickness_of_surfaces(scans, inverted, kMostPoints);
    if (otherwise > as_given - kClearly) return;
    notes_.push_back({"the transform to the LiDAR looks inverted: by its inverse surfaces are " +
                          std::to_string(static_cast<int>(
                              std::lround(100.0 * (1.0 - std::exp(otherwise - as_given))))) +
                          " % thinner; exchange its parent and child, or give --extrinsic",
                      true, true});
  }

  /// Logarithms by the poses as they are and by `other` ones, means over three windows of scans; of
  /// about `most_points` of every second one, where that is given.
  [[nodiscard]] std::array<double, 2> thickness_of_surfaces(
      const std::vector<Contents::ScanStamp>& scans,
      const std::function<std::optional<Pose>(std::int64_t)>& other,
      std::size_t most_points = SIZE_MAX) const {
    constexpr std::size_t kScans = 15;
    const std::size_t apart = most_points == SIZE_MAX ? 1 : 2;
    std::array<double, 2> mean = {};
    for (const std::size_t quarter : {1U, 2U, 3U}) {
      std::array<SurfaceThickness, 2> surfaces;
      const std::size_t first = scans.size() * quarter / 4;
      for (std::size_t i = first; i < std::min(first + kScans, scans.size()); i += apart) {
        const std::array<std::optional<Pose>, 2> poses = {lidar_poses_.at(scans[i].stamp_ns),
                                                          other(scans[i].stamp_ns)};
        if (!poses[0] && !poses[1]) continue;
        Scan scan;
        try {
          decode_scan(message(scans[i].number), topic().serialization, kind_of(topic().type),
                      layout_, scan, scans[i].log_ns);
        } catch (const DatasetError&) {
          continue;  // counted where it is mapped
        }
        const std::size_t step = 1 + scan.points.size() / most_points;
        for (std::size_t k = 0; k < poses.size(); ++k) {
          if (poses[k]) add_scan(scan, *poses[k], i % step, step, surfaces[k]);
        }
      }
      for (std::size_t k = 0; k < mean.size(); ++k) mean[k] += surfaces[k].log_thickness() / 3.0;
    }
    return mean;
  }

  /// Adds every `step`th point of a scan from `first` on.
  static void add_scan(const Scan& scan, const Pose& T_odometry_lidar, std::size_t first,
                       std::size_t step, SurfaceThickness& surfaces) {
    constexpr double kFar_m = 40.0;
    surfaces.begin_scan();
    for (std::size_t k = first; k < scan.points.size(); k += step) {
      const Scan::Point& p = scan.points[k];
      const Eigen::Vector3d point(p.x, p.y, p.z);
      if (point.norm() < kFar_m) surfaces.add(T_odometry_lidar * point);
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
        scans_.push_back({scans[i].number, scans[i].log_ns, scans[i].stamp_ns, *pose});
        after = 0;
      } else {
        ++(scans_.empty() ? before : after);
      }
    }
    const std::size_t within = scans.size() - repeated - before - after - scans_.size();
    constexpr std::size_t kMostRepeated = 3;  // of four: a scan may be there in a few copies
    if (4 * repeated > kMostRepeated * scans.size()) {
      throw DatasetError(std::to_string(repeated) + " of " + count_text(scans.size(), "scan") +
                         " of " + topic().name +
                         " have the stamp of another: mend the driver's stamps, or leave them at "
                         "0 in the header for the times of recording to be taken");
    }
    require_dense_poses(scans, repeated);
    if (scans_.empty()) fail_unposed(scans);
    note_missing(before, within, after, scans.size());
    if (repeated > 0) {
      notes_.push_back(
          {count_text(repeated, "scan") + " with the stamp of another: left out", true});
    }
  }

  /// No scan has a pose.
  [[noreturn]] void fail_unposed(const std::vector<Contents::ScanStamp>& scans) const {
    const std::string none =
        "none of its " + count_text(scans.size(), "scan") + " (" +
        seconds_text(scans.front().stamp_ns) + " to " + seconds_text(scans.back().stamp_ns) +
        " s) has a pose in " + lidar_poses_.description +
        (lidar_poses_.covered_time.empty() ? "" : " (" + lidar_poses_.covered_time + ")");
    if (!lidar_poses_.covered_time.empty() && lidar_poses_.last_ns == 0) {
      throw DatasetError(none + ": these poses have no stamps; give poses with stamps " +
                         "(--odometry-topic, --poses), or take the own odometry (--odometry own)");
    }
    throw DatasetError(none +
                       ": are their clocks the same? If not, write both with one clock, or "
                       "take the own odometry (--odometry own)");
  }

  /// Throws where most scans lie between poses that are too far apart.
  void require_dense_poses(const std::vector<Contents::ScanStamp>& scans,
                           std::size_t repeated) const {
    if (lidar_poses_.apart.empty()) return;
    const auto covered = static_cast<std::size_t>(
        std::count_if(scans.begin(), scans.end(), [this](const auto& scan) {
          return scan.stamp_ns > lidar_poses_.first_ns && scan.stamp_ns < lidar_poses_.last_ns;
        }));
    const std::size_t between = covered - std::min(covered, scans_.size() + repeated);
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
  ImuWish imu_;
  BagPoses poses_;
  PoseSeries file_poses_;
  LidarPoses lidar_poses_;
  std::vector<PosedScan> scans_;
  std::vector<Fix> fixes_;
  std::vector<Note> notes_;
};

}  // namespace

}  // namespace bag

bool recognises_bag(const fs::path& path) { return bag::holds_messages(path); }

std::unique_ptr<Dataset> open_bag(const fs::path& path, const OpenOptions& options) {
  return std::make_unique<bag::BagDataset>(path, options);
}

}  // namespace unimapper::datasets
