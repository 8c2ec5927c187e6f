#include "ports/datasets/own_odometry.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "ports/datasets/decorator.hpp"
#include "ports/datasets/sweep_check.hpp"
#include "unimapper/core/owned.hpp"
#include "unimapper/odometry/odometry.hpp"

namespace unimapper::datasets {
namespace {

/// `LidarOdometry` in a block of its own from the heap.
class HeapOdometry {
 public:
  explicit HeapOdometry(const LidarOdometryConfig& config)
      : block_(LidarOdometry::required_bytes(config)),
        odometry_(LidarOdometry::create(config, block_.span())) {
    if (!odometry_.ok()) {
      throw DatasetError(std::string("odometry: ") + odometry_.error().message);
    }
  }
  LidarOdometry* operator->() { return *odometry_; }

 private:
  MemoryBlock block_;
  Expected<LidarOdometry*> odometry_;
};

/// When the last point of a scan was measured.
std::int64_t last_point_ns(std::int64_t stamp_ns, const Scan& scan) {
  const auto last = std::max_element(scan.time_s.begin(), scan.time_s.end());
  constexpr double kPerSecond = 1e9;
  return last == scan.time_s.end()
             ? stamp_ns
             : stamp_ns + static_cast<std::int64_t>(kPerSecond * static_cast<double>(*last));
}

/// Scans of a kind, and the first of them.
struct Tally {
  std::size_t scans = 0;
  std::size_t first = 0;
  const char* reason = "";

  void add(std::size_t scan, const char* why) {
    if (scans++ > 0) return;
    first = scan;
    reason = why == nullptr ? "" : why;
  }
};

/// What the accelerometer said of up, over a drive.
struct UpOfDrive {
  std::size_t scans = 0;  ///< scans whose up was known
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double weight = 0.0;
  double variance_rad2 = 0.0;

  void add(const OdometryResult& result) {
    const double variance = result.up_sigma_rad * result.up_sigma_rad;
    if (!std::isfinite(variance)) return;
    ++scans;
    sum += result.up / variance;
    weight += 1.0 / variance;
    variance_rad2 += variance;
  }
  [[nodiscard]] Eigen::Vector3d mean() const {
    return scans > 0 ? sum.normalized() : Eigen::Vector3d(Eigen::Vector3d::UnitZ());
  }
  /// Of a scan's up against the mean's z axis: its own, and what lies between the two.
  [[nodiscard]] double sigma_deg() const {
    constexpr double kLeast_deg = 1.0;  // offsets of 20 mg are usual without calibration
    constexpr double kMost_deg = 5.0;   // tells less than a level road
    if (scans == 0) return 0.0;
    const double length = sum.norm() / weight;  // below 1 as far as they differ
    const double variance =
        variance_rad2 / static_cast<double>(scans) + std::max(0.0, 1.0 - length * length);
    const double sigma = std::sqrt(variance) * kDegreesPerRadian;
    return sigma > kMost_deg ? 0.0 : std::max(kLeast_deg, sigma);
  }
};

/// Scans farther apart share so little that another motion may fit as well.
constexpr std::int64_t kFar_ns = 600'000'000;

class OwnOdometryDataset final : public DatasetDecorator {
 public:
  OwnOdometryDataset(std::shared_ptr<Dataset> dataset, const RecordedGyroscope& imu,
                     const OwnOdometryOptions& options)
      : DatasetDecorator(std::move(dataset)), gyroscope_{{}, imu.description, imu.notes} {
    const std::size_t all = inner().scan_count();
    const std::size_t count = options.most_scans == 0 ? all : std::min(options.most_scans, all);
    poses_.resize(options.first_scan);
    fits_.resize(options.first_scan, 0.0F);
    slips_.resize(options.first_scan, Eigen::Matrix3d::Zero());
    HeapOdometry odometry{LidarOdometryConfig{}};
    auto sample = imu.samples.begin();
    Pose last;
    Scan scan;
    for (std::size_t i = options.first_scan; i < count; ++i) {
      inner().read_scan(i, scan);
      if (options.deskew == Deskew::kOff) scan.time_s.clear();
      const std::int64_t last_ns = last_point_ns(inner().stamp_ns(i), scan);
      for (; sample != imu.samples.end() && sample->stamp_ns <= last_ns; ++sample) {
        static_cast<void>(odometry->add_angular_velocity(sample->stamp_ns, sample->rad_s));
        if (sample->acceleration.isZero(0.0)) continue;
        static_cast<void>(odometry->add_acceleration(sample->stamp_ns, sample->acceleration));
      }
      const OdometryResult result =
          odometry->add_scan(inner().stamp_ns(i), scan.view(), scan.time_s);
      if (result.error.ok()) last = result.T_odometry_sensor;
      poses_.push_back(last);
      slips_.push_back(slip_of(result));
      const bool is_tracking = result.error.ok() && result.state == OdometryState::kTracking;
      fits_.push_back(is_tracking ? static_cast<float>(result.fit) : 0.0F);
      up_.add(result);
      count_state(i, result);
      if (i > 0 && inner().stamp_ns(i) - inner().stamp_ns(i - 1) > kFar_ns) far_.add(i, "");
      if (options.progress) options.progress(i + 1, count);
    }
    statistics_ = odometry->statistics();
    if (statistics_.imu_contradicted()) up_ = {};  // what it told before, too
    level(options.T_base_lidar);
  }

  /// Throws DatasetError: a trajectory that is guessed for the most part is no trajectory.
  void require_tracking() const {
    if (2 * lost_.scans <= poses_.size()) return;
    throw DatasetError("own odometry lost " + described(lost_) +
                       ": give the poses of another one with --poses");
  }

  /// How well a scan that determines its motion fits those before, from 0 to 1; else 0.
  [[nodiscard]] double fit(std::size_t scan) const { return static_cast<double>(fits_[scan]); }
  /// Adds a note.
  void add_note(Note note) { more_notes_.push_back(std::move(note)); }

  [[nodiscard]] std::size_t scan_count() const override { return poses_.size(); }
  [[nodiscard]] const Pose& pose(std::size_t i) const override { return poses_.at(i); }
  [[nodiscard]] Eigen::Matrix3d slip(std::size_t i) const override { return slips_.at(i); }
  [[nodiscard]] double up_sigma_deg() const override { return up_.sigma_deg(); }
  [[nodiscard]] std::optional<Pose> pose_at(std::int64_t /*stamp_ns*/) const override {
    return std::nullopt;
  }
  [[nodiscard]] std::vector<Pose> ground_truth_poses() const override {
    std::vector<Pose> poses = inner().ground_truth_poses();
    poses.resize(std::min(poses.size(), poses_.size()));
    return poses;
  }
  [[nodiscard]] bool has_poses() const override { return true; }
  [[nodiscard]] std::vector<Note> notes() const override {
    std::vector<Note> notes = inner().notes();
    notes.insert(notes.end(), gyroscope_.notes.begin(), gyroscope_.notes.end());
    const bool has_gyroscope = statistics_.scans_by_gyroscope > 0;
    notes.push_back({"poses: of the own odometry, from the scans " +
                         (has_gyroscope ? "and a gyroscope: " + gyroscope_.description +
                                              " foretells the rotation of " +
                                              std::to_string(statistics_.scans_by_gyroscope) +
                                              " of " + std::to_string(poses_.size()) + " scans"
                                        : "alone"),
                     false});
    notes.insert(notes.end(), more_notes_.begin(), more_notes_.end());
    add_doubts_of_gyroscope(notes);
    add_accelerometer(notes);
    add_note(degenerate_, "do not determine the motion in every direction", notes);
    add_note(far_, "come more than 0.6 s after the one before: a wrong motion may pass unnoticed",
             notes);
    add_note(lost_, "could not be registered: poses go on as before", notes);
    if (statistics_.points_refused + statistics_.points_without_voxel > 0) {
      notes.push_back({"own odometry: no room for " + std::to_string(statistics_.points_refused) +
                           " points of scans and " +
                           std::to_string(statistics_.points_without_voxel) + " of the local map",
                       true});
    }
    return notes;
  }

 private:
  void count_state(std::size_t scan, const OdometryResult& result) {
    if (!result.error.ok() || result.state == OdometryState::kLost) {
      lost_.add(scan, result.error.ok() ? result.reason : result.error.message);
    } else if (result.state == OdometryState::kDegenerate) {
      degenerate_.add(scan, result.reason);
    }
  }

  /// From the frame of the first pose to one of the robot, level if up is known.
  void level(const Pose& T_base_lidar) {
    if (poses_.empty()) return;
    Pose T_new_odometry = T_base_lidar * poses_[0].inverse();
    if (up_.sigma_deg() > 0.0) {
      const Eigen::Vector3d up = T_new_odometry.rotation * up_.mean();
      const auto turn = Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ());
      T_new_odometry = Pose(turn, Eigen::Vector3d::Zero()) * T_new_odometry;
    }
    const Eigen::Matrix3d& R = T_new_odometry.rotation;
    for (Pose& pose : poses_) pose = T_new_odometry * pose;
    for (Eigen::Matrix3d& slip : slips_) slip = R * slip * R.transpose();
  }

  void add_accelerometer(std::vector<Note>& notes) const {
    const std::string whose = "accelerometer: " + gyroscope_.description;
    if (up_.sigma_deg() > 0.0) {
      char sigma[32];
      std::snprintf(sigma, sizeof sigma, "%.1f", up_.sigma_deg());
      notes.push_back({whose + " tells up to " + sigma + " degrees", false});
    } else if (statistics_.accelerations > 0) {
      notes.push_back({whose + " does not tell up: the first pose is taken for level", true});
    }
    if (statistics_.accelerations_refused > 0) {
      notes.push_back({whose + ": " + std::to_string(statistics_.accelerations_refused) +
                           " samples are of 200 m/s² or more, or of a stamp that another has",
                       true});
    }
    if (statistics_.updates_in_g > 0) {
      notes.push_back({whose + " is in g, not in m/s²: taken for that", true});
    }
    if (statistics_.updates_implausible > 0) {
      notes.push_back(
          {whose + ": " + std::to_string(statistics_.updates_implausible) + " of " +
               std::to_string(statistics_.updates_implausible + statistics_.updates_of_up) +
               " stretches of 2 s are not used: their mean is no gravity, in m/s² or g",
           true});
    }
  }

  void add_doubts_of_gyroscope(std::vector<Note>& notes) const {
    if (gyroscope_.description.empty()) return;
    const std::uint64_t used = statistics_.scans_by_gyroscope;
    const std::uint64_t against = statistics_.scans_against_gyroscope;
    const std::string whose = "gyroscope: " + gyroscope_.description;
    constexpr std::uint64_t kWarningShare = 10;
    if (against > 0) {
      notes.push_back(
          {whose + " contradicts " + std::to_string(against) + " of " +
               std::to_string(poses_.size()) +
               " scans, and is not used for them; are axes, unit (rad/s) and clock right?",
           kWarningShare * against > used});
    } else if (used == 0) {
      notes.push_back(
          {whose + " has no samples less than 50 ms apart at the times of the scans: not used",
           true});
    }
    if (statistics_.angular_velocities_refused > 0) {
      notes.push_back({whose + ": " + std::to_string(statistics_.angular_velocities_refused) +
                           " samples are of 34 rad/s or more, or of a stamp that another has",
                       true});
    }
  }

  [[nodiscard]] std::string described(const Tally& tally) const {
    return std::to_string(tally.scans) + " of " + std::to_string(poses_.size()) + " scans, first " +
           inner().scan_name(tally.first) +
           (*tally.reason == '\0' ? "" : " (" + std::string(tally.reason) + ")");
  }

  void add_note(const Tally& tally, const char* what, std::vector<Note>& notes) const {
    if (tally.scans == 0) return;
    notes.push_back({"own odometry: " + described(tally) + ", " + what, true});
  }

  RecordedGyroscope gyroscope_;  // without the samples
  std::vector<Pose> poses_;
  std::vector<Eigen::Matrix3d> slips_;
  std::vector<float> fits_;
  UpOfDrive up_;
  OdometryStatistics statistics_;
  Tally degenerate_;
  Tally lost_;
  Tally far_;
  std::vector<Note> more_notes_;
};

/// Whether the times of points are those of sweeps that are compensated already: without them scans
/// are sharper, and fit those before better. Poses that are found from distorted scans make these
/// sharp, too, but they fit less well.
bool are_compensated(const std::shared_ptr<Dataset>& recording, const RecordedGyroscope& imu,
                     const OwnOdometryOptions& options, const Dataset& with_times) {
  constexpr double kFitsBetter = 1.01;
  double fit_with = 0.0;
  double fit_without = 0.0;
  std::size_t compared = 0;
  std::size_t fitted = 0;
  const auto read = [&](std::size_t first, std::size_t end) {
    constexpr std::size_t kBegin = 5;  // scans until the velocity is known
    OwnOdometryOptions some = options;
    some.first_scan = first > kBegin ? first - kBegin : 0;
    some.most_scans = end;
    some.progress = {};
    auto with = std::make_unique<OwnOdometryDataset>(recording, imu, some);
    some.deskew = Deskew::kOff;
    auto without = std::make_unique<OwnOdometryDataset>(recording, imu, some);
    for (std::size_t i = first; i < end; ++i) {
      ++compared;
      if (with->fit(i) == 0.0 || without->fit(i) == 0.0) continue;
      ++fitted;
      fit_with += with->fit(i);
      fit_without += without->fit(i);
    }
    return BothReadings{std::move(with), std::move(without)};
  };
  return is_sharper_without_times(with_times, read) && 2 * fitted >= compared &&
         fit_without > kFitsBetter * fit_with;
}

}  // namespace

std::unique_ptr<Dataset> with_own_odometry(std::unique_ptr<Dataset> dataset,
                                           const OwnOdometryOptions& options) {
  const std::shared_ptr<Dataset> recording = std::move(dataset);
  const RecordedGyroscope imu = recording->gyroscope();
  auto own = std::make_unique<OwnOdometryDataset>(recording, imu, options);
  if (options.deskew == Deskew::kAuto && are_compensated(recording, imu, options, *own)) {
    OwnOdometryOptions without_times = options;
    without_times.deskew = Deskew::kOff;
    own = std::make_unique<OwnOdometryDataset>(recording, imu, without_times);
    own->add_note(
        {"own odometry: without the points' times, as they are compensated already: "
         "scans are sharper so",
         false});
  }
  own->require_tracking();
  return own;
}

}  // namespace unimapper::datasets
