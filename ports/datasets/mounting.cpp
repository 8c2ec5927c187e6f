#include "ports/datasets/mounting.hpp"

#include <algorithm>
#include <cstdio>
#include <optional>
#include <set>
#include <utility>

#include "ports/datasets/decorator.hpp"
#include "ports/datasets/sensor_motion.hpp"

namespace unimapper::datasets {
namespace {

class MountedDataset : public DatasetDecorator {
 public:
  MountedDataset(std::unique_ptr<Dataset> dataset, const Pose& T_base_lidar)
      : DatasetDecorator(std::move(dataset)), T_base_lidar_(T_base_lidar) {
    for (std::size_t i = 0; i < scan_count(); ++i) {
      poses_.push_back(inner().pose(i) * T_base_lidar_);
    }
  }

  [[nodiscard]] const Pose& pose(std::size_t i) const override { return poses_.at(i); }
  [[nodiscard]] std::optional<Pose> pose_at(std::int64_t stamp_ns) const override {
    const auto T_odometry_base = inner().pose_at(stamp_ns);
    if (!T_odometry_base) return std::nullopt;
    return *T_odometry_base * T_base_lidar_;
  }
  [[nodiscard]] std::vector<Pose> ground_truth_poses() const override {
    std::vector<Pose> poses = inner().ground_truth_poses();
    for (Pose& pose : poses) pose = pose * T_base_lidar_;
    return poses;
  }

 private:
  Pose T_base_lidar_;
  std::vector<Pose> poses_;
};

class RetimedDataset : public DatasetDecorator {
 public:
  RetimedDataset(std::unique_ptr<Dataset> dataset, double offset_s)
      : DatasetDecorator(std::move(dataset)),
        offset_ns_(static_cast<std::int64_t>(offset_s * 1e9)) {
    const SensorMotion motion(inner());
    for (std::size_t i = 0; i < scan_count(); ++i) {
      poses_.push_back(pose_at(motion, stamp_ns(i) - offset_ns_));
    }
  }

  [[nodiscard]] const Pose& pose(std::size_t i) const override { return poses_.at(i); }
  [[nodiscard]] std::optional<Pose> pose_at(std::int64_t stamp_ns) const override {
    return inner().pose_at(stamp_ns - offset_ns_);
  }

 private:
  /// Beyond the ends the motion up to there, of as long a time, goes on.
  [[nodiscard]] Pose pose_at(const SensorMotion& motion, std::int64_t wanted_ns) const {
    const auto known = inner().pose_at(wanted_ns);
    if (known) return *known;
    const std::int64_t end_ns =
        std::clamp(wanted_ns, stamp_ns(0), std::max(stamp_ns(0), stamp_ns(scan_count() - 1)));
    const Pose end = motion.at(end_ns);
    if (end_ns == wanted_ns) return motion.at(wanted_ns);
    return end * motion.at(2 * end_ns - wanted_ns).inverse() * end;
  }

  std::int64_t offset_ns_;
  std::vector<Pose> poses_;
};

/// The odometry's frame, turned about its x axis: points stay as the LiDAR saw them.
class TurnedOverDataset : public DatasetDecorator {
 public:
  explicit TurnedOverDataset(std::unique_ptr<Dataset> dataset)
      : DatasetDecorator(std::move(dataset)) {
    for (std::size_t i = 0; i < scan_count(); ++i) poses_.push_back(turned(inner().pose(i)));
  }

  [[nodiscard]] const Pose& pose(std::size_t i) const override { return poses_.at(i); }
  [[nodiscard]] std::optional<Pose> pose_at(std::int64_t stamp_ns) const override {
    const auto pose = inner().pose_at(stamp_ns);
    return pose ? std::optional<Pose>(turned(*pose)) : std::nullopt;
  }
  [[nodiscard]] Eigen::Matrix3d slip(std::size_t i) const override {
    const Eigen::Matrix3d R = turned(Pose()).rotation;
    return R * inner().slip(i) * R.transpose();
  }

 private:
  static Pose turned(const Pose& pose) {
    const Pose over(Eigen::Matrix3d(Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal()),
                    Eigen::Vector3d::Zero());
    return over * pose;
  }

  std::vector<Pose> poses_;
};

class SeveralLidars : public DatasetDecorator {
 public:
  explicit SeveralLidars(std::vector<std::unique_ptr<Dataset>> datasets)
      : DatasetDecorator(std::move(datasets.front())) {
    others_.assign(std::make_move_iterator(datasets.begin() + 1),
                   std::make_move_iterator(datasets.end()));
    for (const auto& other : others_) partners_.push_back(nearest_scans(*other));
  }

  void read_scan(std::size_t i, Scan& scan) const override {
    inner().read_scan(i, scan);
    scan.ring.clear();
    for (std::size_t k = 0; k < others_.size(); ++k) {
      if (partners_[k][i]) append(i, *others_[k], *partners_[k][i], scan);
    }
  }
  [[nodiscard]] std::vector<std::uint32_t> labels(std::size_t /*i*/) const override { return {}; }
  [[nodiscard]] std::string sensor() const override { return {}; }

  [[nodiscard]] std::vector<Note> notes() const override {
    std::vector<Note> notes = inner().notes();
    for (std::size_t k = 0; k < others_.size(); ++k) {
      for (const Note& note : others_[k]->notes()) {
        const bool is_said = std::any_of(notes.begin(), notes.end(),
                                         [&](const Note& said) { return said.text == note.text; });
        if (!is_said) notes.push_back(note);
      }
      notes.push_back(note_of(k));
      if (is_at_first(k)) {
        notes.push_back({"LiDAR " + std::to_string(k + 2) +
                             " is taken to be at the very place of the first, as by a frame that "
                             "both name: right only if the points of both lie in that frame, else "
                             "give --extrinsic once for each",
                         true, true});
      }
    }
    return notes;
  }

 private:
  using Partners = std::vector<std::optional<std::size_t>>;

  [[nodiscard]] Partners nearest_scans(const Dataset& other) const {
    Partners partners(scan_count());
    if (scan_count() < 2) return partners;
    // Half of it where LiDARs take turns, and a little for what the stamps scatter.
    const double interval_ns = static_cast<double>(stamp_ns(scan_count() - 1) - stamp_ns(0)) /
                               static_cast<double>(scan_count() - 1);
    const auto limit_ns = static_cast<std::int64_t>(0.55 * interval_ns);
    std::size_t nearest = 0;
    const auto apart_ns = [&](std::size_t i, std::size_t j) {
      const std::int64_t difference = other.stamp_ns(j) - stamp_ns(i);
      return difference < 0 ? -difference : difference;
    };
    for (std::size_t i = 0; i < scan_count() && other.scan_count() > 0; ++i) {
      while (nearest + 1 < other.scan_count() && apart_ns(i, nearest + 1) <= apart_ns(i, nearest)) {
        ++nearest;
      }
      if (apart_ns(i, nearest) <= limit_ns) partners[i] = nearest;
    }
    return partners;
  }

  void append(std::size_t i, const Dataset& other, std::size_t j, Scan& scan) const {
    Scan points;
    other.read_scan(j, points);
    const Pose T_first_other = pose(i).inverse() * other.pose(j);
    const Eigen::Matrix3f rotation = T_first_other.rotation.cast<float>();
    const Eigen::Vector3f translation = T_first_other.translation.cast<float>();
    for (const Scan::Point& p : points.points) {
      const Eigen::Vector3f moved = rotation * Eigen::Vector3f(p.x, p.y, p.z) + translation;
      scan.points.push_back({moved.x(), moved.y(), moved.z(), p.intensity});
    }
    scan.fingerprint = 31 * scan.fingerprint + points.fingerprint;
    // A point of the other that is late against its scan is late against this one by more.
    scan.time_s.clear();
  }

  /// Whether the two have one place on the robot.
  [[nodiscard]] bool is_at_first(std::size_t k) const {
    for (std::size_t i = 0; i < partners_[k].size(); ++i) {
      if (!partners_[k][i]) continue;
      const auto other = others_[k]->pose_at(stamp_ns(i));
      if (!other) continue;
      const Pose T_first_other = pose(i).inverse() * *other;
      constexpr double kSame = 1e-6;
      return T_first_other.translation.norm() < kSame &&
             rotation_angle(T_first_other.rotation) < kSame;
    }
    return false;
  }

  [[nodiscard]] Note note_of(std::size_t k) const {
    const auto count = static_cast<std::size_t>(
        std::count_if(partners_[k].begin(), partners_[k].end(), [](const auto& j) { return j; }));
    double apart_m = 0.0;
    for (std::size_t i = 0; i < partners_[k].size() && apart_m == 0.0; ++i) {
      if (!partners_[k][i]) continue;
      const Pose other = others_[k]->pose(*partners_[k][i]);
      const auto at_once = others_[k]->pose_at(stamp_ns(i));
      apart_m = (pose(i).inverse() * at_once.value_or(other)).translation.norm();
    }
    std::set<std::size_t> added;
    for (const auto& j : partners_[k]) {
      if (j) added.insert(*j);
    }
    const std::size_t left_out = others_[k]->scan_count() - added.size();
    char text[300];
    std::snprintf(text, sizeof text,
                  "LiDAR %zu added to %zu of %zu scans, %.2f m from the first; free space is "
                  "claimed from the first one's viewpoint; %zu of its own %zu scans are left out: "
                  "no scan of the first takes them",
                  k + 2, count, partners_[k].size(), apart_m, left_out, others_[k]->scan_count());
    constexpr double kFar_m = 0.5;
    return {text, apart_m > kFar_m || 2 * count < partners_[k].size() ||
                      10 * left_out > others_[k]->scan_count()};
  }

  std::vector<std::unique_ptr<Dataset>> others_;
  std::vector<Partners> partners_;  // of each other one, by scan of the first
};

}  // namespace

std::unique_ptr<Dataset> mounted(std::unique_ptr<Dataset> dataset, const Pose& T_base_lidar) {
  return std::make_unique<MountedDataset>(std::move(dataset), T_base_lidar);
}

std::unique_ptr<Dataset> retimed(std::unique_ptr<Dataset> dataset, double offset_s) {
  return std::make_unique<RetimedDataset>(std::move(dataset), offset_s);
}

std::unique_ptr<Dataset> turned_over(std::unique_ptr<Dataset> dataset) {
  return std::make_unique<TurnedOverDataset>(std::move(dataset));
}

std::unique_ptr<Dataset> several_lidars(std::vector<std::unique_ptr<Dataset>> datasets) {
  if (datasets.size() == 1) return std::move(datasets.front());
  return std::make_unique<SeveralLidars>(std::move(datasets));
}

}  // namespace unimapper::datasets
