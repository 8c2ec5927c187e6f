// Tests of the odometry with a gyroscope.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "scene.hpp"

using namespace unimapper;
using namespace unimapper::test;

namespace {

/// What the gyroscope reports of a sensor that stands for a second and then turns to and fro by
/// 30 degrees, twice a second.
struct Samples {
  bool is_there = true;
  double factor = 1.0;  ///< on what is right
  Eigen::Vector3d bias_rad_s{0.02, -0.03, 0.05};
};

Pose swinging(double time_s) {
  constexpr double kRate = 4.0 * 3.14159265;
  const double angle = time_s < 1.0 ? 0.0 : 0.52 * (1.0 - std::cos(kRate * (time_s - 1.0))) / 2.0;
  return level(1.0, 2.0, angle);
}

struct Swing {
  double worst_deg = 0.0;
  OdometryStatistics statistics;
};

/// Errors of rotation over two seconds.
Swing swing(const Samples& samples) {
  TestOdometry odometry;
  Swing swing;
  std::int64_t told_ns = 0;
  for (int i = 1; i <= 20; ++i) {
    const double now_s = 0.1 * i;
    for (; samples.is_there && told_ns <= i * kPeriod_ns; told_ns += 5'000'000) {
      const double time_s = 1e-9 * static_cast<double>(told_ns);
      const double yaw_rad_s = (rotation_angle(swinging(time_s + 1e-3).rotation) -
                                rotation_angle(swinging(time_s - 1e-3).rotation)) /
                               2e-3;
      static_cast<void>(odometry->add_angular_velocity(
          told_ns, samples.factor * yaw_rad_s * Eigen::Vector3d::UnitZ() + samples.bias_rad_s));
    }
    const SweptScan scan = sweep(
        hall(), [&](double after_s) { return swinging(now_s + after_s); },
        static_cast<std::uint64_t>(i));
    const OdometryResult result = odometry.add(scan);
    swing.worst_deg =
        std::max(swing.worst_deg, error_of(result, swinging(0.0), swinging(now_s)).rotation_deg);
  }
  swing.statistics = odometry->statistics();
  return swing;
}

/// Drives at 2 m/s and rolls to and fro by 3 degrees.
Pose rolling(double time_s) {
  constexpr double kRate = 2.0 * 3.14159265;
  const Eigen::AngleAxisd roll(0.05 * std::sin(kRate * time_s), Eigen::Vector3d::UnitX());
  return {Eigen::Quaterniond(roll), {2.0 * time_s - 8.0, 1.0, 0.0}};
}

/// Root of the mean squared error of places on the way.
double error_of_rolling_m(bool has_gyroscope) {
  TestOdometry odometry;
  double squares_m2 = 0.0;
  constexpr int kScans = 20;
  std::int64_t told_ns = 0;
  for (int i = 1; i <= kScans; ++i) {
    for (; has_gyroscope && told_ns <= i * kPeriod_ns; told_ns += 5'000'000) {
      const double time_s = 1e-9 * static_cast<double>(told_ns);
      const Eigen::AngleAxisd turn(rolling(time_s - 1e-3).rotation.transpose() *
                                   rolling(time_s + 1e-3).rotation);
      REQUIRE(odometry->add_angular_velocity(told_ns, turn.angle() / 2e-3 * turn.axis()).ok());
    }
    const SweptScan scan = sweep(
        hall(), [&](double after_s) { return rolling(0.1 * i + after_s); },
        static_cast<std::uint64_t>(i));
    const double error_m =
        error_of(odometry.add(scan), rolling(0.1), rolling(0.1 * i)).translation_m;
    squares_m2 += error_m * error_m / kScans;
  }
  return std::sqrt(squares_m2);
}

/// Where a sensor that stood for three seconds is after a gap, in which it moved by 1.5 m.
/// The first scan behind it is lost: nothing moves so far in a tenth of a second.
double error_after_standing_m(bool has_gyroscope) {
  TestOdometry odometry;
  std::int64_t told_ns = 0;
  const Pose before = level(1.0, 2.0, 0.0);
  const Pose after = level(2.5, 2.0, 0.0);
  OdometryResult result;
  for (int i = 1; i <= 34; ++i) {
    for (; has_gyroscope && told_ns <= i * kPeriod_ns; told_ns += 5'000'000) {
      REQUIRE(odometry->add_angular_velocity(told_ns, Eigen::Vector3d::Zero()).ok());
    }
    const Pose& at = i <= 30 ? before : after;
    result = odometry.add(sweep(
        hall(), [&](double) { return at; }, static_cast<std::uint64_t>(i)));
  }
  return error_of(result, before, after).translation_m;
}

}  // namespace

TEST_CASE("a robot that stood with a gyroscope is found where it moved unseen") {
  const double with_m = error_after_standing_m(true);
  const double without_m = error_after_standing_m(false);
  CAPTURE(with_m, without_m);
  CHECK(without_m < 0.1);
  CHECK(with_m < 0.1);
}

TEST_CASE("a gyroscope makes places no worse where it foretells nearly all of the motion") {
  const double with_m = error_of_rolling_m(true);
  const double without_m = error_of_rolling_m(false);
  CAPTURE(with_m, without_m);
  CHECK(with_m < without_m);
}

TEST_CASE("a gyroscope with a bias helps where the sensor turns to and fro") {
  const Swing with = swing({});
  const Swing without = swing({.is_there = false});
  CAPTURE(with.worst_deg, without.worst_deg);
  CHECK(with.worst_deg < 0.5 * without.worst_deg);
  CHECK(with.statistics.angular_velocities == 401);
}

TEST_CASE("a gyroscope of wrong sign or unit does not count for long") {
  const Swing without = swing({.is_there = false});
  for (const double factor : {-1.0, 57.3}) {
    const Swing wrong = swing({.factor = factor, .bias_rad_s = Eigen::Vector3d::Zero()});
    CAPTURE(factor, wrong.worst_deg, without.worst_deg);
    CHECK(wrong.worst_deg < 2.0 * without.worst_deg + 1.0);
  }
}

TEST_CASE("angular velocities that cannot be are refused and counted") {
  TestOdometry odometry;
  const Eigen::Vector3d slow(0.1, 0.0, 0.0);
  const auto taken = [&](std::int64_t stamp_ns, const Eigen::Vector3d& rad_s) {
    return odometry->add_angular_velocity(stamp_ns, rad_s).ok();
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  CHECK(taken(5, slow));
  CHECK_FALSE(taken(5, slow));
  CHECK_FALSE(taken(4, slow));
  CHECK_FALSE(taken(6, {kNan, 0.0, 0.0}));
  CHECK_FALSE(taken(6, {0.0, kNan, 0.0}));
  CHECK_FALSE(taken(6, {0.0, 0.0, -34.0}));
  CHECK_FALSE(taken(std::numeric_limits<std::int64_t>::max(), slow));
  CHECK(taken(6, slow));
  CHECK(odometry->statistics().angular_velocities == 2);
  CHECK(odometry->statistics().angular_velocities_refused == 6);
}

TEST_CASE("samples that leave a gap change nothing") {
  TestOdometry with;
  TestOdometry without;
  OdometryResult a;
  OdometryResult b;
  for (int i = 1; i <= 4; ++i) {
    REQUIRE(with->add_angular_velocity(i * kPeriod_ns, {1.0, 0.0, 0.0}).ok());
    const SweptScan scan = snapshot(hall(), level(0.1 * i, 0.0, 0.02 * i));
    a = with.add(scan);
    b = without.add(scan);
  }
  CHECK(a.T_odometry_sensor.rotation == b.T_odometry_sensor.rotation);
  CHECK(a.T_odometry_sensor.translation == b.T_odometry_sensor.translation);
}
