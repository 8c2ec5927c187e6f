// Tests of HeLiPR's four binary formats.
#include "ports/datasets/helipr.hpp"

#include "tests/ports/datasets/fixtures.hpp"
#include "tests/test.hpp"

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

std::string repeat(const std::string& record, std::size_t count) {
  std::string bytes;
  for (std::size_t i = 0; i < count; ++i) bytes += record;
  return bytes;
}

Scan check_points(const std::string& bytes, HeliprSensor sensor, std::int64_t stamp_ns,
                  std::size_t count) {
  Scan scan;
  parse_helipr(bytes, sensor, stamp_ns, "scan.bin", scan);
  REQUIRE(scan.points.size() == count);
  for (std::size_t i = 0; i < count; ++i) {
    CHECK(scan.view()[i] == Eigen::Vector3f(1.0F, -2.0F, 0.5F));
    CHECK(scan.points[i].intensity == 250.0F);
  }
  return scan;
}

/// A recording with scans of one point.
struct HeliprSequence : TemporaryDirectory {
  explicit HeliprSequence(const std::vector<std::string>& stamps) {
    for (const std::string& stamp : stamps) write("LiDAR/Avia/" + stamp + ".bin", kAvia);
  }
  void poses(const std::string& text) const { write("LiDAR_GT/Avia_gt.txt", text); }
};

}  // namespace

TEST_CASE("each LiDAR's record has its own length, time after the stamp and laser") {
  struct Format {
    HeliprSensor sensor;
    std::string record;
    std::size_t bytes;
    double time_s;
    std::uint16_t ring;
  };
  for (const Format& format : {Format{HeliprSensor::kOuster, kOuster, 26, 10000e-9, 127},
                               Format{HeliprSensor::kVelodyne, kVelodyne, 22, 0.1, 15},
                               Format{HeliprSensor::kAvia, kAvia, 19, 10000e-9, 5},
                               Format{HeliprSensor::kAeva, kShortAeva, 25, 10000e-9, 63}}) {
    CHECK(format.record.size() == format.bytes);
    const Scan scan =
        check_points(format.record + format.record, format.sensor, kLastShortStamp_ns, 2);
    REQUIRE(scan.time_s.size() == 2);
    CHECK(scan.time_s[1] == Approx(format.time_s));
    CHECK(scan.ring == std::vector<std::uint16_t>{format.ring, format.ring});
  }
  check_points("", HeliprSensor::kAvia, 0, 0);
}

TEST_CASE("Aeva's record length follows from the stamp, else from what divides the file") {
  CHECK(kLongAeva.size() == 29);
  check_points(repeat(kLongAeva, 2), HeliprSensor::kAeva, kLastShortStamp_ns + 1, 2);
  // Renumbered files: the name is no stamp.
  check_points(repeat(kLongAeva, 2), HeliprSensor::kAeva, 1, 2);
  // 725 bytes are 29 short records as well as 25 long ones: the stamp decides.
  check_points(repeat(kShortAeva, 29), HeliprSensor::kAeva, kLastShortStamp_ns, 29);
  check_points(repeat(kLongAeva, 25), HeliprSensor::kAeva, kLastShortStamp_ns + 1, 25);
}

TEST_CASE("a partial record is refused with its offset") {
  const auto error = [](const std::string& bytes, HeliprSensor sensor) {
    Scan scan;
    return error_of([&] { parse_helipr(bytes, sensor, kLastShortStamp_ns + 1, "scan.bin", scan); });
  };
  CHECK_THAT(error(kAvia + "123", HeliprSensor::kAvia),
             Contains("scan.bin: offset 19") && Contains("3 of 19 bytes"));
  CHECK_THAT(error(kLongAeva + "1", HeliprSensor::kAeva), Contains("offset 29"));
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
  // The first scan precedes the trajectory, the last one follows it: they have no pose.
  const HeliprSequence sequence(
      {"1691936557000000001", "1691936557100000001", "1691936557200000001", "1691936557300000001"});
  sequence.poses(
      "1691936557100000001 10 0 0 0 0 0 1\n"
      "1691936557250000001 13 0 0 0 0 0 1\n");
  const auto dataset = open_dataset(sequence.path());
  REQUIRE(dataset->scan_count() == 2);
  CHECK(dataset->scan_name(0) == "1691936557100000001");
  CHECK(dataset->stamp_ns(0) == 1691936557100000001);
  CHECK(dataset->pose(0).translation == Eigen::Vector3d(10, 0, 0));
  CHECK(dataset->pose(1).translation.isApprox(Eigen::Vector3d(12, 0, 0), 1e-12));
  CHECK(dataset->ground_truth_poses().size() == 2);
  CHECK(scan_of(*dataset, 1).points.size() == 1);
}

TEST_CASE("a HeLiPR scan between two poses turns with time from the earlier to the later one") {
  const HeliprSequence sequence({"1691936557110000001"});
  // A quarter turn about z within 0.1 s; the scan comes after a tenth of it.
  sequence.poses(
      "1691936557100000001 0 0 0 0 0 0 1\n"
      "1691936557200000001 10 0 0 0 0 0.7071067811865476 0.7071067811865476\n");
  const Pose pose = open_dataset(sequence.path())->pose(0);
  CHECK(pose.translation.x() == Approx(1.0));
  const double yaw = std::atan2(pose.rotation(1, 0), pose.rotation(0, 0));
  CHECK(yaw == Approx(0.1 * 3.14159265358979 / 2.0));
}

TEST_CASE("a HeLiPR scan may lie between poses half a second apart, not farther") {
  const HeliprSequence sequence({"1691936557200000000"});
  const std::string first = "1691936557000000000 0 0 0 0 0 0 1\n";
  sequence.poses(first + "1691936557500000000 10 0 0 0 0 0 1\n");
  CHECK(open_dataset(sequence.path())->pose(0).translation.x() == Approx(4.0));
  sequence.poses(first + "1691936557500000001 10 0 0 0 0 0 1\n");
  CHECK_THAT(open_error(sequence.path()),
             Contains("at most 0.5 s are bridged: 1 of 1 scans lie between"));
}

TEST_CASE("a HeLiPR sequence that does not fit together is refused") {
  const HeliprSequence sequence({"1000000000"});
  sequence.write("LiDAR/Velodyne/1000000000.bin", kVelodyne);
  const auto error = [&](const std::string& sensor) {
    return open_error(sequence.path(), {.sensor = sensor});
  };
  CHECK_THAT(error(""), Contains("Avia, Velodyne") && Contains("--sensor"));
  CHECK_THAT(error("ouster"), Contains("no LiDAR 'ouster'"));
  CHECK_THAT(error("avia"), Contains("Avia_gt.txt") && Contains("no such file"));
  const std::string pose = " 0 0 0 0 0 0 1\n";
  check_refusals({{"", {"no poses"}},
                  {kIdentityLine, {"expected t x y z qx qy qz qw"}},
                  {"5" + pose + "5 1 0 0 0 0 0 1\n", {"do not increase after 5"}},
                  {"5" + pose, {"covers none of the scans"}},
                  {"5" + pose + "9000000000" + pose, {"poses are 9.0 s apart"}},
                  {"1.5" + pose, {"whole nanoseconds"}}},
                 [&](const std::string& poses) {
                   sequence.poses(poses);
                   (void)open_dataset(sequence.path(), {.sensor = "avia"});
                 });
  sequence.write("LiDAR/Avia/first.bin", kAvia);
  sequence.poses("1000000000" + pose);
  CHECK_THAT(error("avia"), Contains("first.bin") && Contains("nanoseconds"));
}
