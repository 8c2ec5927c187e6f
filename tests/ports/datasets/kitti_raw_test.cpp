// Tests of KITTI raw drives and of KITTI odometry by its root.
#include "ports/datasets/kitti_raw.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/ports/datasets/fixtures.hpp"

using namespace unimapper;
using namespace unimapper::datasets;
using Catch::Matchers::Contains;

namespace {

constexpr const char* kDrive = "2011_09_26_drive_0005_sync";

/// Three scans, the second of which is missing, on a way to the north at 1 m a scan.
void write_drive(const TemporaryDirectory& directory) {
  const std::string drive = std::string(kDrive) + "/";
  const double degrees_per_metre = 180.0 / (3.14159265358979 * 6378137.0);
  std::string times;
  for (int i = 0; i < 3; ++i) {
    const std::string name = "000000000" + std::to_string(i);
    if (i != 1) directory.write(drive + "velodyne_points/data/" + name + ".bin", kPointBytes);
    char packet[200];
    std::snprintf(packet, sizeof packet, "49.0 %.12f 116.4 0 0 %.12f 0 0 0\n",
                  8.0 + i * degrees_per_metre / std::cos(49.0 / 57.29577951308232),
                  1.5707963267949);
    directory.write(drive + "oxts/data/" + name + ".txt", packet);
    times += "2011-09-26 13:02:25." + std::to_string(i + 1) + "00000000\n";
  }
  directory.write(drive + "velodyne_points/timestamps.txt", times);
  directory.write(drive + "oxts/timestamps.txt", times);
  directory.write("calib_imu_to_velo.txt",
                  "calib_time: 25-May-2012 16:47:16\nR: 1 0 0 0 1 0 0 0 1\nT: -0.8 0.3 -0.8\n");
}

}  // namespace

TEST_CASE("a KITTI raw drive has the poses of its GPS and IMU, by stamp") {
  const TemporaryDirectory directory;
  write_drive(directory);
  const bool by_date = GENERATE(true, false);
  const auto dataset = open_dataset(by_date ? directory.path() : directory.path() / kDrive);
  REQUIRE(dataset->scan_count() == 2);
  CHECK(dataset->scan_name(1) == "0000000002");
  CHECK(dataset->stamp_ns(1) - dataset->stamp_ns(0) == 200'000'000);
  const Eigen::Vector3d step = dataset->pose(1).translation - dataset->pose(0).translation;
  CHECK(step.isApprox(Eigen::Vector3d(2, 0, 0), 1e-4));
  // The LiDAR is 0.8 m ahead of the IMU, which looks north (y).
  CHECK(dataset->pose(0).translation.isApprox(Eigen::Vector3d(0.3, 0.8, 0.8), 1e-6));
  CHECK(dataset->sensor() == "hdl-64e");
}

TEST_CASE("the drives of a date are listed where there are several") {
  const TemporaryDirectory directory;
  write_drive(directory);
  directory.write("2011_09_26_drive_0001_sync/velodyne_points/data/0000000000.bin", kPointBytes);
  CHECK_THAT(error_of([&] { (void)open_dataset(directory.path()); }),
             Contains("--sequence") && Contains("drive_0001_sync") && Contains("drive_0005_sync"));
  CHECK(open_dataset(directory.path(), {.sequence = "0005"})->scan_count() == 2);
  CHECK_THAT(error_of([&] { (void)open_dataset(directory.path(), {.sequence = "0001"}); }),
             Contains("no oxts/"));
}

TEST_CASE("damaged packets of KITTI raw are refused with their line") {
  CHECK_THAT(error_of([] { (void)parse_oxts("49.0 8.0\n", "a.txt"); }), Contains("a.txt:1"));
  CHECK_THAT(error_of([] { (void)parse_oxts("490 8 1 0 0 0\n", "a.txt"); }), Contains("latitude"));
  CHECK_THAT(error_of([] { (void)parse_oxts("", "a.txt"); }), Contains("empty"));
  CHECK_FALSE(parse_raw_calibration("R: 1 0 0 0 1 0 0 0 2\nT: 0 0 0\n", "c.txt"));
  CHECK_FALSE(parse_raw_calibration("T: 0 0 0\n", "c.txt"));
}

TEST_CASE("KITTI odometry is read by its root and a sequence") {
  const TemporaryDirectory directory;
  for (const char* sequence : {"00", "07"}) {
    directory.write("dataset/sequences/" + std::string(sequence) + "/velodyne/000000.bin",
                    kPointBytes);
  }
  directory.write("dataset/poses/00.txt", kIdentityLine);
  directory.write("dataset/poses/07.txt", kOneMetreAheadLine);
  for (const char* root : {"dataset", "."}) {
    const auto dataset = open_dataset(directory.path() / root, {.sequence = "07"});
    CHECK(dataset->pose(0).translation.x() == 1.0);
    CHECK_THAT(error_of([&] { (void)open_dataset(directory.path() / root); }),
               Contains("--sequence") && Contains("00, 07"));
  }
}
