// Tests of drives through places that determine the pose.
#include <catch2/catch.hpp>
#include <cstring>

#include "scene.hpp"

using namespace unimapper;
using namespace unimapper::test;

namespace {

/// Along an arc at 6 m/s and 0.4 rad/s.
Pose on_arc(double time_s) {
  const double angle_rad = 0.4 * time_s;
  const double radius_m = 6.0 / 0.4;
  return level(-15.0 + radius_m * std::sin(angle_rad),
               -3.0 + radius_m * (1.0 - std::cos(angle_rad)), angle_rad);
}

/// The last result and its error on a drive along the arc.
struct Drive {
  OdometryResult last;
  PoseError error;
};
Drive drive_on_arc(bool is_swept, bool has_times, int scans = 12) {
  TestOdometry odometry;
  Drive drive;
  for (int i = 0; i < scans; ++i) {
    SweptScan scan = is_swept ? sweep(hall(), [&](double t) { return on_arc(0.1 * i + t); })
                              : snapshot(hall(), on_arc(0.1 * i));
    if (!has_times) scan.time_s.clear();
    drive.last = odometry.add(scan);
    REQUIRE(drive.last.error.ok());
  }
  drive.error = error_of(drive.last, on_arc(0.0), on_arc(0.1 * (scans - 1)));
  return drive;
}

}  // namespace

TEST_CASE("a drive along an arc is recovered") {
  const Drive drive = drive_on_arc(false, false);
  CHECK(drive.error.translation_m < 0.04);
  CHECK(drive.error.rotation_deg < 0.2);
  CHECK(drive.last.state == OdometryState::kTracking);
  CHECK(drive.last.weak.count == 0);
  CHECK(std::string(drive.last.reason).empty());
}

TEST_CASE("the velocity is that of the sensor in its own frame") {
  const OdometryResult last = drive_on_arc(false, false).last;
  CHECK((last.velocity_m_s - Eigen::Vector3d(6.0, 0.0, 0.0)).norm() < 0.3);
  CHECK((last.angular_velocity_rad_s - Eigen::Vector3d(0.0, 0.0, 0.4)).norm() < 0.05);
}

TEST_CASE("sweeps whose points have times are compensated, from the first one on") {
  const Drive drive = drive_on_arc(true, true);
  CHECK(drive.error.translation_m < 0.05);
  CHECK(drive.error.rotation_deg < 0.3);
  const Drive without = drive_on_arc(true, false);
  CHECK(without.error.rotation_deg + without.error.translation_m >
        2.0 * (drive.error.rotation_deg + drive.error.translation_m));
}

TEST_CASE("a sensor that stands does not drift") {
  TestOdometry odometry;
  OdometryResult early;
  OdometryResult last;
  // Means of ten scans: a single pose has the noise of its scan.
  Eigen::Vector3d early_mean_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d last_mean_m = Eigen::Vector3d::Zero();
  for (std::uint64_t i = 0; i < 30; ++i) {
    last = odometry.add(snapshot(hall(), level(1.0, 2.0, 0.3), i));
    if (i == 10) early = last;
    if (i >= 5 && i < 15) early_mean_m += 0.1 * last.T_odometry_sensor.translation;
    if (i >= 20) last_mean_m += 0.1 * last.T_odometry_sensor.translation;
  }
  CHECK(last.T_odometry_sensor.translation.norm() < 0.02);
  CHECK((last_mean_m - early_mean_m).norm() < 0.002);
  const Pose since = early.T_odometry_sensor.inverse() * last.T_odometry_sensor;
  CHECK(rotation_angle(since.rotation) * kDegreesPerRadian < 0.03);
  CHECK(last.velocity_m_s.norm() < 0.06);
}

TEST_CASE("the first scan's pose is the identity, and two scans are a start") {
  TestOdometry odometry;
  const OdometryResult first = odometry.add(snapshot(hall(), level(3.0, 1.0, 1.0)));
  CHECK(first.error.ok());
  CHECK(first.state == OdometryState::kStarting);
  CHECK(first.T_odometry_sensor.translation.norm() == 0.0);
  CHECK(odometry.add(snapshot(hall(), level(3.2, 1.0, 1.0))).state == OdometryState::kStarting);
  CHECK(odometry.add(snapshot(hall(), level(3.4, 1.0, 1.0))).state == OdometryState::kTracking);
}

TEST_CASE("equal scans give equal bits") {
  const OdometryResult a = drive_on_arc(true, true, 5).last;
  const OdometryResult b = drive_on_arc(true, true, 5).last;
  const auto is_equal = [](const auto& x, const auto& y) {
    return std::memcmp(x.data(), y.data(), sizeof(double) * static_cast<std::size_t>(x.size())) ==
           0;
  };
  CHECK(is_equal(a.T_odometry_sensor.rotation, b.T_odometry_sensor.rotation));
  CHECK(is_equal(a.T_odometry_sensor.translation, b.T_odometry_sensor.translation));
  CHECK(is_equal(a.covariance, b.covariance));
}

TEST_CASE("the covariance of a good scan is small and positive definite") {
  const OdometryResult last = drive_on_arc(false, false).last;
  const Eigen::Matrix<double, 6, 6>& covariance = last.covariance;
  CHECK(covariance.isApprox(covariance.transpose(), 1e-9));
  CHECK(covariance.llt().info() == Eigen::Success);
  CHECK(std::sqrt(covariance.topLeftCorner<3, 3>().trace()) < 0.05);
}
