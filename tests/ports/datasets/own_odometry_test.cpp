// Tests of recordings whose poses are those of the own odometry.
#include "ports/datasets/own_odometry.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "ports/datasets/writers.hpp"
#include "tests/odometry/scene.hpp"
#include "tests/ports/datasets/pcd_fixtures.hpp"

using namespace unimapper;
using namespace unimapper::datasets;
using Catch::Matchers::Contains;

namespace {

constexpr int kScans = 8;

/// 0.3 m ahead at each scan, and to the left.
Pose true_pose(int scan) { return test::level(0.3 * scan, 0.006 * scan * scan, 0.04 * scan); }

/// A drive through a hall as a folder of scans without poses.
class Drive : public TemporaryDirectory {
 public:
  Drive() {
    make_directory(path() / "scans");
    for (int i = 0; i < kScans; ++i) {
      std::vector<Scan::Point> points;
      for (const Eigen::Vector3f& p : test::snapshot(test::hall(), true_pose(i)).points) {
        points.push_back({p.x(), p.y(), p.z(), 0.0F});
      }
      write_kitti_scan(path() / "scans" / ("00000" + std::to_string(i) + ".bin"), points);
    }
  }

  /// Poses of another odometry: the robot stands.
  void write_poses() const { write_kitti_poses(path() / "poses.txt", std::vector<Pose>(kScans)); }
};

double error_m(const Dataset& dataset, int scan) {
  return (dataset.pose(static_cast<std::size_t>(scan)).translation - true_pose(scan).translation)
      .norm();
}

/// Ten scans a second of a hall, with times of points and without poses.
class HallScans : public Dataset {
 public:
  void read_scan(std::size_t i, Scan& scan) const override {
    const test::SweptScan swept = sweep(i);
    scan.reset(0);
    for (const Eigen::Vector3f& p : swept.points)
      scan.points.push_back({p.x(), p.y(), p.z(), 0.0F});
    scan.time_s = swept.time_s;
  }
  [[nodiscard]] const Pose& pose(std::size_t /*i*/) const override { return pose_; }
  [[nodiscard]] std::int64_t stamp_ns(std::size_t i) const override {
    return static_cast<std::int64_t>(i + 10) * 100'000'000;
  }
  [[nodiscard]] std::string scan_name(std::size_t i) const override { return std::to_string(i); }
  [[nodiscard]] std::vector<std::uint32_t> labels(std::size_t /*i*/) const override { return {}; }
  [[nodiscard]] std::vector<Pose> ground_truth_poses() const override { return {}; }

 private:
  [[nodiscard]] virtual test::SweptScan sweep(std::size_t scan) const = 0;

  Pose pose_;
};

/// A sensor that stands for half a second and then turns to and fro by 30 degrees, twice a second,
/// and what its gyroscope says, times a factor.
class Swing : public HallScans {
 public:
  explicit Swing(double factor = 1.0, const Eigen::Vector3d& force = Eigen::Vector3d::Zero())
      : factor_(factor), force_(force) {}

  static double yaw_rad(double time_s) {
    return time_s < 0.5 ? 0.0 : 0.26 * (1.0 - std::cos(4.0 * 3.14159265 * (time_s - 0.5)));
  }
  [[nodiscard]] std::size_t scan_count() const override { return force_.isZero() ? 14 : 24; }
  [[nodiscard]] RecordedGyroscope gyroscope() const override {
    RecordedGyroscope gyroscope;
    gyroscope.description = "/imu";
    for (int i = -40; factor_ != 0.0 && i < 500; ++i) {
      const double time_s = 0.005 * i;
      const double yaw_rad_s = (yaw_rad(time_s + 1e-3) - yaw_rad(time_s - 1e-3)) / 2e-3;
      gyroscope.samples.push_back(
          {std::int64_t{5'000'000} * (i + 200), factor_ * yaw_rad_s * Eigen::Vector3d::UnitZ(),
           test::level(0.0, 0.0, yaw_rad(time_s)).rotation.transpose() * force_});
    }
    return gyroscope;
  }

 private:
  [[nodiscard]] test::SweptScan sweep(std::size_t scan) const override {
    return test::sweep(test::hall(), [scan](double after_s) {
      return test::level(0.0, 0.0, yaw_rad(0.1 * static_cast<double>(scan) + after_s));
    });
  }

  double factor_;
  Eigen::Vector3d force_;
};

struct SwingRun {
  double worst_deg = 0.0;
  std::string notes;
};

SwingRun run(double factor) {
  const auto dataset = with_own_odometry(std::make_unique<Swing>(factor), {});
  SwingRun run;
  for (std::size_t i = 0; i < dataset->scan_count(); ++i) {
    const Pose truth = test::level(0.0, 0.0, Swing::yaw_rad(0.1 * static_cast<double>(i)));
    run.worst_deg = std::max(
        run.worst_deg,
        rotation_angle(dataset->pose(i).rotation.transpose() * truth.rotation) * kDegreesPerRadian);
  }
  run.notes = notes_text(*dataset);
  return run;
}

/// A drive along a curve whose points have times: of sweeps, or though they were compensated.
class TimedDrive final : public HallScans {
 public:
  explicit TimedDrive(bool is_compensated) : is_compensated_(is_compensated) {}

  static Pose true_pose(double time_s) {
    return test::level(8.0 * time_s - 10.0, 0.5 * time_s * time_s, 0.4 * time_s);
  }
  [[nodiscard]] std::size_t scan_count() const override { return 18; }

 private:
  [[nodiscard]] test::SweptScan sweep(std::size_t scan) const override {
    const double stamp_s = 0.1 * static_cast<double>(scan);
    constexpr int kColumns = 120;
    return test::sweep(
        test::hall(),
        [&](double after_s) { return true_pose(stamp_s + (is_compensated_ ? 0.0 : after_s)); },
        scan, kColumns);
  }

  bool is_compensated_;
};

}  // namespace

TEST_CASE("the own odometry takes a gyroscope, up to the last point of each scan, and says so") {
  const SwingRun with = run(1.0);
  const SwingRun without = run(0.0);
  CAPTURE(with.worst_deg, without.worst_deg);
  CHECK(with.worst_deg < 0.5 * without.worst_deg);
  CHECK_THAT(with.notes,
             Contains("and a gyroscope: /imu foretells the rotation of 13 of 14 scans"));
  CHECK_THAT(without.notes, Contains("from the scans alone") && Contains("/imu has no samples"));
}

TEST_CASE("a gyroscope that contradicts the scans is not used, with a warning") {
  CHECK_THAT(run(-1.0).notes, Contains("! gyroscope: /imu contradicts"));
}

TEST_CASE("points that were compensated already are found to be, and their times not used") {
  for (const bool is_compensated : {false, true}) {
    CAPTURE(is_compensated);
    const auto dataset = with_own_odometry(std::make_unique<TimedDrive>(is_compensated), {});
    const std::size_t last = dataset->scan_count() - 1;
    const Pose way = TimedDrive::true_pose(0.0).inverse() * TimedDrive::true_pose(0.1 * 17);
    CHECK((dataset->pose(last).translation - way.translation).norm() < 0.05);
    CHECK((notes_text(*dataset).find("without the points' times") != std::string::npos) ==
          is_compensated);
  }
}

TEST_CASE("scans far apart are told: another motion may fit them as well") {
  /// Every seventh scan of the sensor that stands and turns.
  class Sparse final : public Swing {
   public:
    Sparse() : Swing(0.0) {}
    [[nodiscard]] std::size_t scan_count() const override { return 3; }
    [[nodiscard]] std::int64_t stamp_ns(std::size_t i) const override {
      return Swing::stamp_ns(7 * i);
    }
  };
  CHECK_THAT(notes_text(*with_own_odometry(std::make_unique<Sparse>(), {})),
             Contains("! own odometry: 2 of 3 scans, first 1, come more than 0.6 s after"));
  CHECK_THAT(notes_text(*with_own_odometry(std::make_unique<Swing>(0.0), {})),
             !Contains("come more than"));
}

TEST_CASE("an accelerometer levels all poses, in g too, and the dataset tells how well") {
  // A hall that leans by 30 degrees.
  const Eigen::Vector3d up(0.0, 0.5, std::sqrt(0.75));
  const auto dataset = with_own_odometry(std::make_unique<Swing>(1.0, 9.81 * up), {});
  CHECK((dataset->pose(0).rotation * up).z() > 0.995);
  CHECK(dataset->up_sigma_deg() >= 1.0);
  CHECK_THAT(notes_text(*dataset), Contains("accelerometer: /imu tells up to "));
  const auto in_g = with_own_odometry(std::make_unique<Swing>(1.0, up), {});
  CHECK_THAT(notes_text(*in_g), Contains("! accelerometer: /imu is in g, not in m/s²"));
  const auto wrong = with_own_odometry(std::make_unique<Swing>(1.0, 3.0 * up), {});
  CHECK_THAT(notes_text(*wrong), Contains("stretches of 2 s are not used"));
  CHECK(wrong->up_sigma_deg() == 0.0);
}

TEST_CASE("a recording without poses has those of the own odometry") {
  const Drive drive;
  const auto dataset = open_dataset(drive.path());
  REQUIRE(dataset->scan_count() == kScans);
  CHECK(dataset->has_poses());
  CHECK(error_m(*dataset, kScans - 1) < 0.05);
  CHECK_THAT(dataset->notes().back().text, Contains("own odometry"));
}

TEST_CASE("recorded poses come before the own odometry unless it is asked for") {
  const Drive drive;
  drive.write_poses();
  CHECK(open_dataset(drive.path())->pose(kScans - 1).translation.norm() == 0.0);
  CHECK(error_m(*open_dataset(drive.path(), {.own_odometry = true}), kScans - 1) < 0.05);
}

TEST_CASE("the own odometry reads as many scans as are used, and tells how far it is") {
  const Drive drive;
  std::vector<std::size_t> told;
  OpenOptions options;
  options.most_scans = 3;
  options.odometry_progress = [&told](std::size_t done, std::size_t all) {
    CHECK(all == 3);
    told.push_back(done);
  };
  CHECK(open_dataset(drive.path(), options)->scan_count() == 3);
  CHECK(told == std::vector<std::size_t>{1, 2, 3});
}

TEST_CASE("the mount levels the frame of the own odometry") {
  const Drive drive;
  OpenOptions options;
  options.T_base_lidar = {Pose(Eigen::Matrix3d{{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}, {0, 0, 2})};
  const auto dataset = open_dataset(drive.path(), options);
  CHECK(dataset->pose(0).translation.z() == 2.0);
  // The robot drives to the left of a LiDAR that hangs upside down: to its right.
  CHECK(dataset->pose(kScans - 1).translation.y() ==
        Approx(-true_pose(kScans - 1).translation.y()).margin(0.05));
}

TEST_CASE("corrections of recorded poses are refused where there are none") {
  const Drive drive;
  CHECK_THAT(open_error(drive.path(), {.time_offset_s = 0.1}), Contains("--time-offset"));
  CHECK_THAT(open_error(drive.path(), {.finds_mount = true}), Contains("--extrinsic auto"));
}

TEST_CASE("poses are either named or those of the own odometry") {
  const Drive drive;
  drive.write_poses();
  CHECK_THAT(open_error(drive.path(), {.poses = drive.path() / "poses.txt", .own_odometry = true}),
             Contains("leave out --poses"));
}

TEST_CASE("scans of too few points for the own odometry are refused with the remedy") {
  const TemporaryDirectory directory;
  directory.write("scans/000000.bin", kPointBytes);
  directory.write("scans/000001.bin", kPointBytes);
  CHECK_THAT(open_error(directory.path()),
             Contains("own odometry lost 2 of 2 scans") && Contains("--poses"));
}
