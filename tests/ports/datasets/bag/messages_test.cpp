// Tests of the decoders of ROS messages.
#include "ports/datasets/bag/messages.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <limits>

#include "tests/ports/datasets/bag/message_writer.hpp"
#include "tests/ports/datasets/fixtures.hpp"

using namespace unimapper;
using namespace unimapper::datasets;
using namespace unimapper::datasets::bag;
using Catch::Matchers::Contains;

namespace {

constexpr std::int64_t kStamp_ns = 1'700'000'000'250'000'000;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

const Pose kPose{Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5), Eigen::Vector3d(1.5, -2.0, 0.25)};

void check_pose(const std::optional<Pose>& pose) {
  REQUIRE(pose.has_value());
  CHECK(pose->rotation.isApprox(kPose.rotation, 1e-12));
  CHECK(pose->translation == kPose.translation);
}

Scan decode(const std::string& bytes, Serialization serialization,
            MessageKind kind = MessageKind::kPointCloud) {
  Scan scan;
  decode_scan(bytes, serialization, kind, find_layout(bytes, serialization, kind), scan);
  return scan;
}

Scan decode(const CloudOfMessage& cloud, Encoding encoding = Encoding::kCdrLittle) {
  return decode(cloud_message(encoding, kStamp_ns, cloud), serialization_of(encoding));
}

/// Points on the x axis, each with one more field of the given type.
template <typename T>
CloudOfMessage cloud_with(const std::string& name, std::uint8_t type,
                          const std::vector<T>& values) {
  CloudOfMessage cloud;
  cloud.width = static_cast<std::uint32_t>(values.size());
  cloud.fields = {{"x", 0, 7}, {"y", 4, 7}, {"z", 8, 7}, {name, 12, type}};
  cloud.point_step = 12 + sizeof(T);
  cloud.row_step = cloud.width * cloud.point_step;
  for (const T value : values) cloud.data += packed(1.0F, 0.0F, 0.0F, value);
  return cloud;
}

/// A cloud of no points yet, in `height` rows.
CloudOfMessage rows(std::uint32_t height, std::uint32_t width, std::uint32_t row_step) {
  CloudOfMessage cloud = plain_cloud({});
  cloud.height = height;
  cloud.width = width;
  cloud.row_step = row_step;
  return cloud;
}

template <typename T>
std::vector<float> times_of(const std::string& name, std::uint8_t type,
                            const std::vector<T>& values) {
  return decode(cloud_with(name, type, values)).time_s;
}

void check_times(const std::vector<float>& times, const std::vector<float>& expected) {
  CHECK_THAT(times, Catch::Approx(expected).margin(1e-6F));
}

/// livox_ros_driver/CustomMsg: two points, and one without a return between them.
std::string livox_message(Encoding encoding) {
  MessageWriter writer(encoding);
  writer.header(kStamp_ns, "livox_frame").number(std::uint64_t{kStamp_ns});
  writer.number(std::uint32_t{3}).number(std::uint8_t{1}).raw(std::string(3, '\0'));
  writer.number(std::uint32_t{3});
  const auto point = [&](std::uint32_t time_ns, float x, std::uint8_t line) {
    writer.number(time_ns).number(x).number(2 * x).number(3 * x);
    writer.number(std::uint8_t{200}).number(std::uint8_t{16}).number(line);
  };
  point(0, 1.0F, 0);
  point(20'000'000, 0.0F, 1);
  point(90'000'000, 2.0F, 5);
  return writer.bytes();
}

}  // namespace

TEST_CASE("the angular velocity of an IMU is read in every serialization") {
  for (const Encoding encoding : kEncodings) {
    const ImuMessage imu = decode_imu(imu_message(encoding, kStamp_ns, {0.1, -0.2, 0.3}, "/imu"),
                                      serialization_of(encoding));
    CHECK(imu.header.stamp_ns == kStamp_ns);
    CHECK(imu.header.frame == "imu");
    REQUIRE(imu.rad_s);
    CHECK(*imu.rad_s == Eigen::Vector3d(0.1, -0.2, 0.3));
  }
}

TEST_CASE("odometry and poses are decoded in every encoding") {
  for (const Encoding encoding : kEncodings) {
    const Serialization serialization = serialization_of(encoding);
    const auto odometry = decode_poses(odometry_message(encoding, kStamp_ns, kPose, "/odom", "b"),
                                       serialization, MessageKind::kOdometry);
    REQUIRE(odometry.size() == 1);
    CHECK(odometry[0].header.stamp_ns == kStamp_ns);
    CHECK(odometry[0].header.frame == "odom");
    CHECK(odometry[0].child_frame == "b");
    check_pose(odometry[0].pose);

    const auto pose =
        decode_poses(pose_message(encoding, kStamp_ns, kPose), serialization, MessageKind::kPose);
    CHECK(pose[0].header.frame == "map");
    CHECK(pose[0].child_frame.empty());
    check_pose(pose[0].pose);
  }
}

TEST_CASE("a fix is decoded in every encoding") {
  for (const Encoding encoding : kEncodings) {
    const std::string bytes = fix_message(encoding, kStamp_ns, {-1, 48.5, -11.25, 520.5, 0.5, 0});
    const FixMessage fix = decode_fix(bytes, serialization_of(encoding));
    CHECK(fix.header.stamp_ns == kStamp_ns);
    CHECK(fix.header.frame == "gps");
    CHECK(fix.status == -1);
    CHECK(fix.latitude_deg == 48.5);
    CHECK(fix.longitude_deg == -11.25);
    CHECK(fix.height_m == 520.5);
    CHECK(fix.variances == std::array{0.25, 0.25, 0.25});
    CHECK_FALSE(fix.has_variances);
    for (std::size_t cut = 0; cut < bytes.size(); ++cut) {
      CHECK_THROWS_AS(decode_fix(bytes.substr(0, cut), serialization_of(encoding)), DatasetError);
    }
  }
}

TEST_CASE("every transform of a message is decoded in every encoding") {
  for (const Encoding encoding : kEncodings) {
    const auto message = transforms_message(
        encoding, {{kStamp_ns, "odom", "base", Pose()}, {kStamp_ns + 1, "base", "lidar", kPose}});
    const auto transforms =
        decode_poses(message, serialization_of(encoding), MessageKind::kTransforms);
    REQUIRE(transforms.size() == 2);
    CHECK(transforms[0].header.frame == "odom");
    CHECK(transforms[0].child_frame == "base");
    CHECK(transforms[1].header.stamp_ns == kStamp_ns + 1);
    check_pose(transforms[1].pose);
  }
}

TEST_CASE("a quaternion that is none, or a number that is not finite, gives no pose") {
  Pose pose = kPose;
  pose.translation.x() = std::numeric_limits<double>::quiet_NaN();
  const auto bytes = pose_message(Encoding::kRos1, kStamp_ns, pose);
  CHECK_FALSE(decode_poses(bytes, Serialization::kRos1, MessageKind::kPose)[0].pose);
  MessageWriter zero(Encoding::kRos1);
  zero.header(kStamp_ns, "map");
  for (int i = 0; i < 7; ++i) zero.number(0.0);
  CHECK_FALSE(decode_poses(zero.bytes(), Serialization::kRos1, MessageKind::kPose)[0].pose);
}

TEST_CASE("points of a cloud are decoded in every encoding") {
  for (const Encoding encoding : kEncodings) {
    const Scan scan = decode(plain_cloud({{1, 2, 3}, {4, 5, 6}}), encoding);
    REQUIRE(scan.points.size() == 2);
    CHECK(scan.view()[1] == Eigen::Vector3f(4, 5, 6));
    CHECK(scan.points[1].intensity == 0.0F);
    CHECK(scan.time_s.empty());
    CHECK(scan.ring.empty());
  }
}

TEST_CASE("fields may have any type, order and space between them") {
  CloudOfMessage cloud;
  cloud.width = 1;
  cloud.fields = {{"Ring", 0, 2},         {"z", 2, 3},  {"y", 8, 8},
                  {"reflectivity", 4, 4}, {"x", 16, 7}, {"rgb", 999, 99}};
  cloud.point_step = 24;
  cloud.row_step = 24;
  cloud.data = packed(std::uint8_t{7}, std::uint8_t{0xFF}, std::int16_t{-3}, std::uint16_t{500},
                      std::uint16_t{0}, 2.5, 1.5F, std::uint32_t{0});
  const Scan scan = decode(cloud);
  REQUIRE(scan.points.size() == 1);
  CHECK(scan.view()[0] == Eigen::Vector3f(1.5F, 2.5F, -3.0F));
  CHECK(scan.points[0].intensity == 500.0F);
  CHECK(scan.ring == std::vector<std::uint16_t>{7});
}

TEST_CASE("points may be big endian in a little-endian message") {
  CloudOfMessage cloud = rows(1, 1, 12);
  cloud.is_big_endian = true;
  cloud.data = hex("3f800000 c0000000 3f000000");
  const Scan scan = decode(cloud, Encoding::kRos1);
  REQUIRE(scan.points.size() == 1);
  CHECK(scan.view()[0] == Eigen::Vector3f(1.0F, -2.0F, 0.5F));
}

TEST_CASE("a wrong order of bytes is told by the distances that it gives") {
  CloudOfMessage cloud = plain_cloud({{1, 2, 3}, {kNan, kNan, kNan}, {0, 0, 0}, {4, 5, 6}});
  cloud.is_big_endian = true;
  const auto bytes = cloud_message(Encoding::kRos1, kStamp_ns, cloud);
  CHECK(find_layout(bytes, Serialization::kRos1, MessageKind::kPointCloud).are_bytes_swapped);
  const Scan scan = decode(cloud);
  REQUIRE(scan.points.size() == 2);
  CHECK(scan.view()[1] == Eigen::Vector3f(4, 5, 6));
}

TEST_CASE("of two fields with one name the one with differing numbers is taken") {
  CloudOfMessage cloud;
  cloud.width = 2;
  cloud.fields = {{"x", 0, 7}, {"y", 0, 7}, {"z", 0, 7}, {"x", 4, 7}, {"y", 8, 7}};
  cloud.point_step = 12;
  cloud.data = packed(0.0F, 1.0F, 2.0F, 0.0F, 4.0F, 5.0F);
  CHECK(decode(cloud).view()[1] == Eigen::Vector3f(4, 5, 0));
}

TEST_CASE("a ring that is the same of many points is no ring") {
  const std::vector<std::uint16_t> same(101, 0);
  CHECK(decode(cloud_with<std::uint16_t>("ring", 4, same)).ring.empty());
}

TEST_CASE("a cloud tells what its sizes leave out, and a size that was left at 0") {
  CloudOfMessage cloud = plain_cloud({{1, 2, 3}, {4, 5, 6}});
  cloud.point_step = 0;
  CHECK(decode(cloud).view()[1] == Eigen::Vector3f(4, 5, 6));
  cloud.point_step = 12;
  cloud.width = 1;
  const auto bytes = cloud_message(Encoding::kRos1, kStamp_ns, cloud);
  CHECK(find_layout(bytes, Serialization::kRos1, MessageKind::kPointCloud).unread_share == 0.5);
  cloud.width = 0;
  CHECK_THAT(error_of([&] { decode(cloud); }), Contains("24 bytes of data, but 1 x 0 points"));
}

TEST_CASE("rows of an organised cloud may be padded, and number the lasers where no field does") {
  CloudOfMessage cloud = rows(2, 1, 16);
  cloud.data = packed(1.0F, 1.0F, 1.0F, 9.0F, 2.0F, 2.0F, 2.0F);
  const Scan scan = decode(cloud);
  REQUIRE(scan.points.size() == 2);
  CHECK(scan.view()[1] == Eigen::Vector3f(2, 2, 2));
  CHECK(scan.ring == std::vector<std::uint16_t>{0, 1});
  // A step between rows that was left out.
  cloud.row_step = 0;
  cloud.data = packed(1.0F, 1.0F, 1.0F, 2.0F, 2.0F, 2.0F);
  CHECK(decode(cloud, Encoding::kRos1).view()[1] == Eigen::Vector3f(2, 2, 2));
}

TEST_CASE("points without a return are left out and counted") {
  const auto bytes = cloud_message(Encoding::kRos1, kStamp_ns,
                                   plain_cloud({{0, 0, 0}, {1, 2, 3}, {kNan, 0, 0}, {0, 0, 1}}));
  Scan scan;
  const auto layout = find_layout(bytes, Serialization::kRos1, MessageKind::kPointCloud);
  CHECK(decode_scan(bytes, Serialization::kRos1, MessageKind::kPointCloud, layout, scan) == 2);
  REQUIRE(scan.points.size() == 2);
  CHECK(scan.view()[0] == Eigen::Vector3f(1, 2, 3));
  CHECK(scan.view()[1] == Eigen::Vector3f(0, 0, 1));
}

TEST_CASE("the unit of a point's time follows from its numbers") {
  const std::vector<float> expected = {0.0F, 0.05F, 0.1F};
  check_times(times_of<std::uint32_t>("t", 6, {0, 50'000'000, 100'000'000}), expected);
  check_times(times_of<std::uint32_t>("t", 6, {0, 50'000, 100'000}), expected);
  check_times(times_of<std::uint16_t>("time", 4, {0, 50, 100}), expected);
  check_times(times_of<float>("time", 7, {0.0F, 0.05F, 0.1F}), expected);
  check_times(times_of<float>("time", 7, {-0.1F, -0.05F, 0.0F}), {-0.1F, -0.05F, 0.0F});
  check_times(times_of<std::int32_t>("time_offset", 5, {-50'000'000, 0}), {-0.05F, 0.0F});
}

TEST_CASE("a point's time may be a stamp, or by another clock from the scan's first point on") {
  const double stamp_s = 1'700'000'000.25;
  const std::vector<float> expected = {-0.05F, 0.05F};
  check_times(times_of<double>("timestamp", 8, {stamp_s - 0.05, stamp_s + 0.05}), expected);
  check_times(times_of<double>("timestamp", 8, {stamp_s * 1e9 - 5e7, stamp_s * 1e9 + 5e7}),
              expected);
  const auto other_clock = cloud_with<double>("timestamp", 8, {812.30, 812.25, 812.35});
  const auto bytes = cloud_message(Encoding::kCdrLittle, kStamp_ns, other_clock);
  const auto layout = find_layout(bytes, Serialization::kCdr, MessageKind::kPointCloud);
  REQUIRE(layout.clock.has_value());
  CHECK(layout.clock->zero == PointClock::Zero::kOwn);
  check_times(decode(other_clock).time_s, {0.05F, 0.0F, 0.1F});
}

TEST_CASE("times that are all the same tell nothing") {
  CHECK(times_of<float>("time", 7, {0.0F, 0.0F}).empty());
  CHECK(times_of<double>("timestamp", 8, {1.7e9, 1.7e9}).empty());
}

TEST_CASE("single times that are of no sweep do not decide the unit, and are counted") {
  std::vector<float> seconds;
  std::vector<std::uint32_t> nanoseconds;
  for (std::uint32_t i = 0; i < 100; ++i) {
    seconds.push_back(0.001F * static_cast<float>(i));
    nanoseconds.push_back(i * 1'000'000);
  }
  seconds[7] = 3.6F;
  nanoseconds[0] -= 5000;
  const Scan late = decode(cloud_with("time", 7, seconds));
  CHECK(late.time_s.at(7) == late.time_s.at(6));
  for (const Scan& scan : {late, decode(cloud_with("t", 6, nanoseconds))}) {
    REQUIRE(scan.time_s.size() == 100);
    CHECK(scan.points_without_time == 1);
    CHECK(scan.time_s[99] == Approx(0.099));
  }
}

TEST_CASE("times of any number do not decide the unit, though they are a third of a scan's") {
  std::vector<std::uint32_t> times;
  for (std::uint32_t i = 0; i < 300; ++i) {
    times.push_back(i % 3 == 1 ? i * 14'000'000U : i * 333'000U);
  }
  const Scan scan = decode(cloud_with("t", 6, times));
  REQUIRE(scan.time_s.size() == 300);
  CHECK(scan.time_s[299] == Approx(299 * 333e-6));
  CHECK(scan.points_without_time > 90);
  CHECK(scan.points_without_time < 100);
}

TEST_CASE("a number that a driver leaves in many points is no time") {
  std::vector<float> times;
  for (int i = 0; i < 300; ++i) times.push_back(i % 4 == 1 ? 0.0F : -0.1F + 3e-4F * float(i));
  const Scan scan = decode(cloud_with("time", 7, times));
  REQUIRE(scan.time_s.size() == 300);
  CHECK(scan.points_without_time == 75);
  CHECK(scan.time_s[201] == scan.time_s[200]);
  CHECK(scan.time_s[200] == Approx(-0.04).margin(1e-4));
}

TEST_CASE("a sweep whose returns are of a few directions keeps its times") {
  std::vector<double> times;
  for (int i = 0; i < 60; ++i) times.push_back(0.001 + 1e-4 * i);
  for (int i = 0; i < 40; ++i) times.push_back(0.08 + 5e-4 * i);
  const TimeRange range = sweep_range(times);
  CHECK(range.least == times.front());
  CHECK(range.greatest == times.back());
}

TEST_CASE("of two time fields the one that is all zero is passed over") {
  for (const bool is_first_zero : {true, false}) {
    CloudOfMessage cloud;
    cloud.width = 3;
    cloud.fields = {{"x", 0, 7}, {"y", 4, 7}, {"z", 8, 7}, {"t", 12, 6}, {"time", 16, 7}};
    cloud.point_step = 20;
    cloud.row_step = 60;
    for (const std::uint32_t ms : {0U, 50U, 100U}) {
      cloud.data += packed(1.0F, 0.0F, 0.0F, is_first_zero ? 0U : ms * 1'000'000U,
                           is_first_zero ? 0.001F * static_cast<float>(ms) : 0.0F);
    }
    check_times(decode(cloud).time_s, {0.0F, 0.05F, 0.1F});
  }
}

TEST_CASE("a scan keeps the recording's unit unless it covers a thousand times more or less") {
  const PointClock usual{1e-9, PointClock::Zero::kStamp};
  const auto unit = [&](double seconds_per_unit, double span_s) {
    const auto clock =
        find_clock_like(usual, 1e8, TimeRange{0.0, span_s / seconds_per_unit}, std::nullopt);
    return clock ? clock->seconds_per_unit : 0.0;
  };
  CHECK(unit(1e-9, 0.1) == 1e-9);
  CHECK(unit(1e-9, 0.001) == 1e-9);  // cut: not a second in microseconds
  CHECK(unit(1.0, 0.1) == 1.0);
  CHECK(unit(1e-6, 0.1) == 1e-6);
  CHECK(unit(1e-9, 0.0) == 0.0);
  CHECK(unit(1e-9, 30.0) == 0.0);
}

TEST_CASE("rows are lasers only where their elevations are apart") {
  const auto rings_of = [](const std::function<float(std::uint32_t, std::uint32_t)>& elevation) {
    CloudOfMessage cloud = rows(4, 16, 12 * 16);
    for (std::uint32_t row = 0; row < cloud.height; ++row) {
      for (std::uint32_t column = 0; column < cloud.width; ++column) {
        cloud.data += packed(10.0F, 0.0F, 10.0F * std::tan(elevation(row, column)));
      }
    }
    return decode(cloud).ring;
  };
  const auto row_at = [](std::uint32_t row) { return 0.03F * static_cast<float>(row); };
  CHECK(rings_of([&](auto row, auto column) {
          return row_at(row) + 0.004F * static_cast<float>(column % 3);
        }).size() == 64);
  CHECK(rings_of([&](auto row, auto) { return row_at((row * 3) % 4); }).size() == 64);
  // Returns of one pulse in rows of their own; a camera's image.
  CHECK(rings_of([](auto, auto column) { return 0.03F * static_cast<float>(column); }).empty());
  CHECK(rings_of([&](auto row, auto column) {
          return row_at(row) + 0.01F * static_cast<float>(column);
        }).empty());
}

TEST_CASE("Livox's own message is decoded in every encoding") {
  for (const Encoding encoding : kEncodings) {
    const Scan scan =
        decode(livox_message(encoding), serialization_of(encoding), MessageKind::kLivox);
    REQUIRE(scan.points.size() == 2);
    CHECK(scan.view()[1] == Eigen::Vector3f(2, 4, 6));
    CHECK(scan.points[1].intensity == 200.0F);
    check_times(scan.time_s, {0.0F, 0.09F});
    CHECK(scan.ring == std::vector<std::uint16_t>{0, 5});
  }
}

TEST_CASE("a cloud that cannot be is refused with the reason") {
  const auto error = [](const CloudOfMessage& cloud) { return error_of([&] { decode(cloud); }); };
  CloudOfMessage cloud = plain_cloud({{1, 2, 3}});
  cloud.width = 2;
  CHECK_THAT(error(cloud), Contains("1 x 2 points of 12 bytes do not fit its 12 bytes of data"));
  cloud.width = cloud.height = cloud.point_step = UINT32_MAX;
  CHECK_THAT(error(cloud), Contains("do not fit"));
  cloud = plain_cloud({{1, 2, 3}});
  cloud.height = UINT32_MAX;
  cloud.row_step = 0;
  CHECK_THAT(error(cloud), Contains("do not fit"));
  cloud = plain_cloud({{1, 2, 3}});
  cloud.fields[2].offset = 9;
  CHECK_THAT(error(cloud), Contains("its field 'z' lies outside of its point"));
  cloud.fields[2] = {"z", 8, 9};
  CHECK_THAT(error(cloud), Contains("its field 'z' has the unknown type 9"));
  cloud.fields[2].name = "depth";
  CHECK_THAT(error(cloud), Contains("no x, y and z but x y depth"));
  cloud = plain_cloud({{1, 2, 3}});
  cloud.point_step = 0;
  cloud.width = 5;
  CHECK_THAT(error(cloud), Contains("its points have no bytes"));
}

TEST_CASE("a message cut anywhere is refused") {
  const auto check = [](const std::string& message, std::size_t needed, const auto& read) {
    for (std::size_t cut = 0; cut < needed; ++cut) {
      CHECK_THROWS_AS(read(message.substr(0, cut)), DatasetError);
    }
  };
  for (const Encoding encoding : kEncodings) {
    const Serialization serialization = serialization_of(encoding);
    const auto cloud = cloud_message(encoding, kStamp_ns, plain_cloud({{1, 2, 3}}));
    check(cloud, cloud.size() - 1, [&](const auto& bytes) { decode(bytes, serialization); });
    const auto livox = livox_message(encoding);
    check(livox, livox.size(),
          [&](const auto& bytes) { decode(bytes, serialization, MessageKind::kLivox); });
    const auto transforms = transforms_message(encoding, {{kStamp_ns, "a", "b", kPose}});
    check(transforms, transforms.size(), [&](const auto& bytes) {
      (void)decode_poses(bytes, serialization, MessageKind::kTransforms);
    });
  }
}

TEST_CASE("another encoding than ROS 2's is refused") {
  const std::string xcdr2 = hex("00070000") + std::string(64, '\0');
  CHECK_THAT(error_of([&] { decode_header(xcdr2, Serialization::kCdr); }), Contains("XCDR1"));
}
