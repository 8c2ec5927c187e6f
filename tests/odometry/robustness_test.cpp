// Tests of scans that cannot be used, of jumps and of gaps.
#include <catch2/catch.hpp>
#include <limits>
#include <string>

#include "scene.hpp"

using namespace unimapper;
using namespace unimapper::test;

namespace {

/// A drive through the hall, 0.3 m a scan.
Pose on_line(int scan) { return level(-12.0 + 0.3 * scan, 0.5, 0.1); }

SweptScan scan_on_line(int scan) { return snapshot(hall(), on_line(scan)); }

bool is_finite(const OdometryResult& result) {
  return result.T_odometry_sensor.is_rigid() && result.covariance.allFinite() &&
         result.velocity_m_s.allFinite() && result.angular_velocity_rad_s.allFinite();
}

}  // namespace

TEST_CASE("a scan that is refused changes nothing") {
  const SweptScan scan = scan_on_line(3);
  TestOdometry undisturbed;
  TestOdometry odometry;
  for (int i = 0; i < 3; ++i) {
    undisturbed.pass(scan_on_line(i));
    odometry.pass(scan_on_line(i));
  }
  const std::int64_t now_ns = 3 * kPeriod_ns;
  const auto refused = [&](std::int64_t stamp_ns, const PointView& points,
                           std::span<const float> time_s = {}) {
    return odometry->add_scan(stamp_ns, points, time_s).error.code;
  };
  CHECK(refused(now_ns, scan.view()) == ErrorCode::kTimeReversed);
  CHECK(refused(-5, scan.view()) == ErrorCode::kTimeReversed);
  CHECK(refused(now_ns + 1, PointView{}) == ErrorCode::kEmptyScan);
  CHECK(refused(now_ns + 1, PointView::xyz(scan.points.data(), 50, 12)) == ErrorCode::kEmptyScan);
  const std::vector<float> one(1, 0.0F);
  CHECK(refused(now_ns + 1, scan.view(), one) == ErrorCode::kInvalidConfig);
  const std::vector<float> no_numbers(scan.points.size(), std::numeric_limits<float>::quiet_NaN());
  CHECK(refused(now_ns + 1, scan.view(), no_numbers) == ErrorCode::kEmptyScan);
  const std::vector<Eigen::Vector3f> no_points(
      5000, Eigen::Vector3f::Constant(std::numeric_limits<float>::infinity()));
  CHECK(refused(now_ns + 1, PointView::xyz(no_points.data(), 5000, 12)) == ErrorCode::kEmptyScan);

  const OdometryResult expected = undisturbed.add(scan);
  const OdometryResult result = odometry.add(scan);
  CHECK(result.error.ok());
  CHECK(result.T_odometry_sensor.translation == expected.T_odometry_sensor.translation);
  CHECK(result.T_odometry_sensor.rotation == expected.T_odometry_sensor.rotation);
  CHECK(odometry->statistics().scans == 4);
}

TEST_CASE("points that are no numbers, and times that are none, are left out") {
  TestOdometry odometry;
  OdometryResult last;
  for (int i = 0; i < 4; ++i) {
    SweptScan scan = scan_on_line(i);
    scan.time_s.assign(scan.points.size(), 0.0F);
    for (std::size_t k = 0; k < scan.points.size(); k += 5) {
      scan.points[k].y() = std::numeric_limits<float>::quiet_NaN();
      scan.time_s[k + 1] = k % 2 == 0 ? std::numeric_limits<float>::quiet_NaN() : 1e9F;
    }
    last = odometry.add(scan);
  }
  CHECK(error_of(last, on_line(0), on_line(3)).translation_m < 0.03);
}

TEST_CASE("one scan from elsewhere is lost, and the next one is found") {
  TestOdometry odometry;
  OdometryResult last;
  for (int i = 0; i < 8; ++i) {
    last = odometry.add(i == 5 ? snapshot(elsewhere(), level(0.0, 0.0, 0.0)) : scan_on_line(i));
    CHECK((last.state == OdometryState::kLost) == (i == 5));
    if (i > 0) CHECK((last.fit < 0.4) == (i == 5));
    CHECK(is_finite(last));
    if (i == 5) CHECK(std::string(last.reason).find("does not fit") != std::string::npos);
  }
  CHECK(error_of(last, on_line(0), on_line(7)).translation_m < 0.05);
  CHECK(odometry->statistics().restarts == 0);
}

TEST_CASE("where no robot can be within a tenth of a second it is not said to be") {
  TestOdometry odometry;
  OdometryResult last;
  for (int i = 0; i < 12; ++i) {
    // 3 m ahead: the place is in the map, and the scan fits it.
    last = odometry.add(scan_on_line(i == 6 ? i + 10 : i));
    CHECK((last.state == OdometryState::kLost) == (i == 6));
    const double error_m = error_of(last, on_line(0), on_line(i)).translation_m;
    CHECK(error_m < 0.05);
  }
  CHECK(odometry->statistics().restarts == 0);
}

TEST_CASE("a new map may fit less well than the one before") {
  TestOdometry odometry;
  for (int i = 0; i < 6; ++i) odometry.pass(scan_on_line(i));
  Random random(3);
  OdometryResult last;
  for (int i = 0; i < 16; ++i) {
    SweptScan scan = snapshot(elsewhere(), level(0.2 * i, 0.0, 0.0));
    for (Eigen::Vector3f& point : scan.points) {
      point *= static_cast<float>(1.0 + random.uniform(-0.02, 0.02));
    }
    last = odometry.add(scan);
  }
  CHECK(last.state != OdometryState::kLost);
  CHECK(odometry->statistics().restarts == 1);
}

TEST_CASE("times that hardly differ are those of one moment") {
  TestOdometry odometry;
  SweptScan scan = scan_on_line(0);
  scan.time_s.assign(scan.points.size(), 0.0F);
  scan.time_s.back() = 1e-40F;
  odometry.pass(scan);
  scan = scan_on_line(1);
  scan.time_s.assign(scan.points.size(), 0.0F);
  scan.time_s.back() = 1e-40F;
  CHECK(is_finite(odometry.add(scan)));
}

TEST_CASE("a robot that was carried away is lost, and goes on with a new map") {
  TestOdometry odometry;
  for (int i = 0; i < 4; ++i) odometry.pass(scan_on_line(i));
  OdometryResult last;
  OdometryResult at_restart;
  int lost = 0;
  constexpr int kScans = 12;
  for (int i = 0; i < kScans; ++i) {
    last = odometry.add(snapshot(elsewhere(), level(0.2 * i, 0.0, 0.0)));
    CHECK(is_finite(last));
    if (last.state != OdometryState::kLost) continue;
    ++lost;
    at_restart = last;
    CHECK(last.covariance(0, 0) > 1.0);
  }
  CHECK(lost == 5);
  CHECK(odometry->statistics().restarts == 1);
  CHECK(std::string(at_restart.reason).find("anew") != std::string::npos);
  CHECK(last.state == OdometryState::kTracking);
  const Pose since = at_restart.T_odometry_sensor.inverse() * last.T_odometry_sensor;
  CHECK((since.translation - Eigen::Vector3d(0.2 * (kScans - lost), 0.0, 0.0)).norm() < 0.05);
}

TEST_CASE("a gap in the stamps is bridged where the place is still in the map") {
  TestOdometry odometry;
  for (int i = 0; i < 4; ++i) odometry.pass(scan_on_line(i));
  const SweptScan scan = scan_on_line(6);
  const OdometryResult last =
      odometry->add_scan(30 * kPeriod_ns, scan.view(), std::span<const float>());
  CHECK(last.state == OdometryState::kTracking);
  CHECK(error_of(last, on_line(0), on_line(6)).translation_m < 0.05);
}

TEST_CASE(
    "whoever turns by more than a quarter between scans more than a second apart is followed") {
  const auto pose = [](int i) {
    return i < 4 ? level(-8.0, 1.0, 0.0) : level(-8.0 + 0.5 * (i - 3), 1.0, 1.8 * (i - 3));
  };
  TestOdometry odometry;
  for (int i = 0; i < 7; ++i) {
    const SweptScan scan = snapshot(hall(), pose(i), static_cast<std::uint64_t>(i));
    const OdometryResult result =
        odometry->add_scan(15 * i * kPeriod_ns, scan.view(), std::span<const float>());
    CHECK(error_of(result, pose(0), pose(i)).translation_m < 0.1);
    CHECK(error_of(result, pose(0), pose(i)).rotation_deg < 1.0);
  }
}

TEST_CASE("a second scan most of a second after the first finds whoever drives") {
  const auto pose = [](int i) { return level(-20.0 + 4.0 * i, 0.4 * i, 0.1 * i); };
  TestOdometry odometry;
  for (int i = 0; i < 4; ++i) {
    const SweptScan scan = snapshot(hall(), pose(i), static_cast<std::uint64_t>(i));
    const OdometryResult result =
        odometry->add_scan(8 * i * kPeriod_ns, scan.view(), std::span<const float>());
    CHECK(error_of(result, pose(0), pose(i)).translation_m < 0.1);
  }
}

TEST_CASE("stamps may lie as far apart as they can") {
  TestOdometry odometry;
  const SweptScan scan = scan_on_line(0);
  const std::span<const float> none;
  CHECK(odometry->add_scan(std::numeric_limits<std::int64_t>::min(), scan.view(), none).error.ok());
  const OdometryResult last =
      odometry->add_scan(std::numeric_limits<std::int64_t>::max(), scan.view(), none);
  CHECK(last.error.ok());
  CHECK(is_finite(last));
}

TEST_CASE("what a full map and a full scan have no room for is counted") {
  LidarOdometryConfig config = test_config();
  config.max_voxels = 1024;
  config.max_points = 1024;
  config.voxel_m = 0.3;
  TestOdometry odometry(config);
  for (int i = 0; i < 3; ++i) CHECK(odometry.add(scan_on_line(i)).error.ok());
  CHECK(odometry->statistics().voxels <= 1024);
  CHECK(odometry->statistics().points_without_voxel > 0);
  CHECK(odometry->statistics().points_refused > 0);
}

TEST_CASE("voxels out of range are forgotten") {
  LidarOdometryConfig config = test_config();
  config.max_range_m = 8.0;
  TestOdometry odometry(config);
  for (int i = 0; i < 40; ++i) odometry.pass(snapshot(hall(), level(-20.0 + 0.5 * i, 0.0, 0.0)));
  const std::uint32_t before = odometry->statistics().voxels;
  for (int i = 40; i < 80; ++i) odometry.pass(snapshot(hall(), level(-20.0 + 0.5 * i, 0.0, 0.0)));
  CHECK(odometry->statistics().voxels < before + before / 4);
}
