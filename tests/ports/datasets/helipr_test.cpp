// Tests of HeLiPR's four binary formats.
#include "ports/datasets/helipr.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/ports/datasets/fixtures.hpp"

using namespace unimapper;
using namespace unimapper::datasets;
using Catch::Matchers::Contains;

namespace {

const std::string kPosition = hex("0000803f 000000c0 0000003f");

/// One record each, as the sensors' own fields follow the position.
const std::string kOuster = kPosition + hex("00007a43 10270000 0a00 7f00 ff03");
const std::string kVelodyne = kPosition + hex("00007a43 0f00 cdcccc3d");
const std::string kAvia = kPosition + hex("fa 10 05 10270000");
const std::string kShortAeva = kPosition + hex("00007a43 0000a0c0 10270000 3f");
const std::string kLongAeva = kShortAeva + hex("00002041");

constexpr std::int64_t kLastShortStamp_ns = 1691936557946849179;

void check_points(const std::string& bytes, HeliprSensor sensor, std::int64_t stamp_ns,
                  std::size_t count) {
  Scan scan;
  parse_helipr(bytes, sensor, stamp_ns, "scan.bin", scan);
  REQUIRE(scan.points.size() == count);
  for (std::size_t i = 0; i < count; ++i) {
    CHECK(scan.view()[i] == Eigen::Vector3f(1.0F, -2.0F, 0.5F));
    CHECK(scan.points[i].intensity == 250.0F);
  }
}

}  // namespace

TEST_CASE("each LiDAR's record has its own length") {
  CHECK(kOuster.size() == 26);
  CHECK(kVelodyne.size() == 22);
  CHECK(kAvia.size() == 19);
  CHECK(kShortAeva.size() == 25);
  CHECK(kLongAeva.size() == 29);
  check_points(kOuster + kOuster, HeliprSensor::kOuster, 0, 2);
  check_points(kVelodyne + kVelodyne, HeliprSensor::kVelodyne, 0, 2);
  check_points(kAvia + kAvia, HeliprSensor::kAvia, 0, 2);
  check_points("", HeliprSensor::kAvia, 0, 0);
}

TEST_CASE("each point has its time after the stamp and its laser") {
  const auto check = [](const std::string& bytes, HeliprSensor sensor, double time_s,
                        std::uint16_t ring) {
    Scan scan;
    parse_helipr(bytes, sensor, kLastShortStamp_ns, "scan.bin", scan);
    REQUIRE(scan.time_s.size() == 1);
    CHECK(scan.time_s[0] == Approx(time_s));
    CHECK(scan.ring == std::vector<std::uint16_t>{ring});
  };
  check(kOuster, HeliprSensor::kOuster, 10000e-9, 127);
  check(kVelodyne, HeliprSensor::kVelodyne, 0.1, 15);
  check(kAvia, HeliprSensor::kAvia, 10000e-9, 5);
  check(kShortAeva, HeliprSensor::kAeva, 10000e-9, 63);
}

TEST_CASE("Aeva's record length follows from the stamp, else from what divides the file") {
  check_points(kShortAeva + kShortAeva, HeliprSensor::kAeva, kLastShortStamp_ns, 2);
  check_points(kLongAeva + kLongAeva, HeliprSensor::kAeva, kLastShortStamp_ns + 1, 2);
  // Renumbered files: the name is no stamp.
  check_points(kLongAeva + kLongAeva, HeliprSensor::kAeva, 1, 2);
  // 725 bytes are 29 short records as well as 25 long ones: the stamp decides.
  std::string both;
  for (int i = 0; i < 29; ++i) both += kShortAeva;
  check_points(both, HeliprSensor::kAeva, kLastShortStamp_ns, 29);
  both.clear();
  for (int i = 0; i < 25; ++i) both += kLongAeva;
  check_points(both, HeliprSensor::kAeva, kLastShortStamp_ns + 1, 25);
}

TEST_CASE("a partial record is refused with its offset") {
  Scan scan;
  CHECK_THAT(
      error_of([&] { parse_helipr(kAvia + "123", HeliprSensor::kAvia, 0, "scan.bin", scan); }),
      Contains("scan.bin: offset 19") && Contains("3 of 19 bytes"));
  CHECK_THAT(error_of([&] {
               parse_helipr(kLongAeva + "1", HeliprSensor::kAeva, kLastShortStamp_ns + 1,
                            "scan.bin", scan);
             }),
             Contains("offset 29"));
}

TEST_CASE("sensors are found by folder or by model") {
  CHECK(find_helipr_sensor("Ouster") == HeliprSensor::kOuster);
  CHECK(find_helipr_sensor("os2-128") == HeliprSensor::kOuster);
  CHECK(find_helipr_sensor("avia") == HeliprSensor::kAvia);
  CHECK(find_helipr_sensor("livox-avia") == HeliprSensor::kAvia);
  CHECK(find_helipr_sensor("VLP-16") == HeliprSensor::kVelodyne);
  CHECK(find_helipr_sensor("aeva") == HeliprSensor::kAeva);
  CHECK_FALSE(find_helipr_sensor("hdl-64e"));
  CHECK_FALSE(find_helipr_sensor("thermometer"));
}

TEST_CASE("a HeLiPR sequence takes poses by stamp") {
  const TemporaryDirectory directory;
  directory.write("LiDAR/Avia/1691936557000000001.bin", kAvia);
  directory.write("LiDAR/Avia/1691936557100000001.bin", kAvia);
  directory.write("LiDAR/Avia/1691936557200000001.bin", kAvia + kAvia);
  directory.write("LiDAR/Avia/1691936557300000001.bin", kAvia);
  directory.write("LiDAR_GT/Avia_gt.txt",
                  "1691936557100000001 10 0 0 0 0 0 1\n"
                  "1691936557250000001 13 0 0 0 0 0 1\n");
  // The first scan precedes the trajectory, the last one follows it: they have no pose.
  const auto dataset = open_dataset(directory.path());
  REQUIRE(dataset->scan_count() == 2);
  CHECK(dataset->scan_name(0) == "1691936557100000001");
  CHECK(dataset->stamp_ns(0) == 1691936557100000001);
  CHECK(dataset->pose(0).translation == Eigen::Vector3d(10, 0, 0));
  CHECK(dataset->pose(1).translation.isApprox(Eigen::Vector3d(12, 0, 0), 1e-12));
  CHECK(dataset->ground_truth_poses().size() == 2);
  Scan scan;
  dataset->read_scan(1, scan);
  CHECK(scan.points.size() == 2);
}

TEST_CASE("a HeLiPR scan between two poses turns with time from the earlier to the later one") {
  const TemporaryDirectory directory;
  directory.write("LiDAR/Avia/1691936557110000001.bin", kAvia);
  // A quarter turn about z within 0.1 s; the scan comes after a tenth of it.
  directory.write("LiDAR_GT/Avia_gt.txt",
                  "1691936557100000001 0 0 0 0 0 0 1\n"
                  "1691936557200000001 10 0 0 0 0 0.7071067811865476 0.7071067811865476\n");
  const Pose pose = open_dataset(directory.path())->pose(0);
  CHECK(pose.translation.x() == Approx(1.0));
  const double yaw = std::atan2(pose.rotation(1, 0), pose.rotation(0, 0));
  CHECK(yaw == Approx(0.1 * 3.14159265358979 / 2.0));
}

TEST_CASE("a HeLiPR scan may lie between poses half a second apart, not farther") {
  const TemporaryDirectory directory;
  directory.write("LiDAR/Avia/1691936557200000000.bin", kAvia);
  const auto until = [&](const std::string& stamp) {
    directory.write("LiDAR_GT/Avia_gt.txt",
                    "1691936557000000000 0 0 0 0 0 0 1\n" + stamp + " 10 0 0 0 0 0 1\n");
  };
  until("1691936557500000000");
  CHECK(open_dataset(directory.path())->pose(0).translation.x() == Approx(4.0));
  until("1691936557500000001");
  CHECK_THAT(error_of([&] { (void)open_dataset(directory.path()); }),
             Contains("at most 0.5 s are bridged: 1 of 1 scans lie between"));
}

TEST_CASE("a HeLiPR sequence that does not fit together is refused") {
  const TemporaryDirectory directory;
  directory.write("LiDAR/Avia/1000000000.bin", kAvia);
  directory.write("LiDAR/Velodyne/1000000000.bin", kVelodyne);
  const auto error = [&](const std::string& sensor) {
    return error_of([&] { (void)open_dataset(directory.path(), {.sensor = sensor}); });
  };
  CHECK_THAT(error(""), Contains("Avia, Velodyne") && Contains("--sensor"));
  CHECK_THAT(error("ouster"), Contains("no LiDAR 'ouster'"));
  CHECK_THAT(error("avia"), Contains("Avia_gt.txt") && Contains("no such file"));
  directory.write("LiDAR_GT/Avia_gt.txt", "");
  CHECK_THAT(error("avia"), Contains("no poses"));
  directory.write("LiDAR_GT/Avia_gt.txt", kIdentityLine);
  CHECK_THAT(error("avia"), Contains("expected t x y z qx qy qz qw"));
  directory.write("LiDAR_GT/Avia_gt.txt", "5 0 0 0 0 0 0 1\n5 0 0 0 0 0 0 1\n");
  CHECK_THAT(error("avia"), Contains("do not increase after 5"));
  directory.write("LiDAR_GT/Avia_gt.txt", "5 0 0 0 0 0 0 1\n");
  CHECK_THAT(error("avia"), Contains("covers none of the scans"));
  directory.write("LiDAR_GT/Avia_gt.txt", "5 0 0 0 0 0 0 1\n9000000000 0 0 0 0 0 0 1\n");
  CHECK_THAT(error("avia"), Contains("poses are 9.0 s apart"));
  directory.write("LiDAR_GT/Avia_gt.txt", "1.5 0 0 0 0 0 0 1\n");
  CHECK_THAT(error("avia"), Contains("whole nanoseconds"));
  directory.write("LiDAR/Avia/first.bin", kAvia);
  directory.write("LiDAR_GT/Avia_gt.txt", "1000000000 0 0 0 0 0 0 1\n");
  CHECK_THAT(error("avia"), Contains("first.bin") && Contains("nanoseconds"));
}
