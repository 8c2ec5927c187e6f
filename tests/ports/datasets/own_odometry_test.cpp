// Tests of recordings whose poses are those of the own odometry.
#include "ports/datasets/own_odometry.hpp"

#include <catch2/catch.hpp>

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

}  // namespace

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
