// Tests of up by the accelerometer.
#include "src/odometry/accelerometer.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <limits>

#include "scene.hpp"

using namespace unimapper;
using namespace unimapper::test;

namespace {

constexpr double kG_m_s2 = 9.80665;

double tilt_deg(const Eigen::Vector3d& up) {
  return std::acos(std::clamp(up.normalized().z(), -1.0, 1.0)) * kDegreesPerRadian;
}

/// A drive in a hall, and what an accelerometer says of it.
struct Drive {
  double roll_deg = 0.0;  ///< of the sensor on the robot
  double from_s = -1.0;   ///< first sample
  double unit = 1.0;      ///< on what is right
  double noise_m_s2 = 0.05;
  double vibration_m_s2 = 0.0;  ///< amplitude, 37 times a second
  Eigen::Vector3d bias_m_s2 = Eigen::Vector3d::Zero();
  std::function<double(double)> way_m = [](double) { return 0.0; };
  double yaw_rad_s = 0.0;
  double gyroscope_rad_s = 0.0;  ///< of the yaw; 0: there is none
  double drift_deg_s = 0.0;      ///< of what the scans show, about x
  int scans = 40;
  int columns = 160;  ///< of a sweep: enough for a hall
  bool is_there = true;

  [[nodiscard]] Pose at(double time_s) const {
    Pose pose = level(way_m(time_s) - 10.0, 1.0, yaw_rad_s * time_s);
    pose.rotation *= Eigen::AngleAxisd(roll_deg / kDegreesPerRadian, Eigen::Vector3d::UnitX())
                         .toRotationMatrix();
    return pose;
  }
  [[nodiscard]] Eigen::Vector3d force(double time_s) const {
    constexpr double kStep_s = 1e-3;
    const auto place = [&](double t) { return Eigen::Vector3d(at(t).translation); };
    const Eigen::Vector3d moved =
        (place(time_s + kStep_s) - 2.0 * place(time_s) + place(time_s - kStep_s)) /
        (kStep_s * kStep_s);
    const Eigen::AngleAxisd drift(drift_deg_s * std::max(0.0, time_s) / kDegreesPerRadian,
                                  Eigen::Vector3d::UnitX());
    return at(time_s).rotation.transpose() * (moved + kG_m_s2 * (drift * Eigen::Vector3d::UnitZ()));
  }
};

struct Driven {
  OdometryResult first;
  OdometryResult last;
  double worst_m = 0.0;         ///< against the truth in the level frame of the first scan
  double worst_tilt_deg = 0.0;  ///< of the true up in the odometry frame
  double worst_sigmas = 0.0;    ///< error of up in its sigmas
  OdometryStatistics statistics;
};

Driven drive(const Drive& plan) {
  TestOdometry odometry;
  Driven driven;
  Random random(7);
  std::int64_t told_ns = static_cast<std::int64_t>(plan.from_s * 1e9);
  Pose T_level_first;
  for (int i = 1; i <= plan.scans; ++i) {
    for (; plan.is_there && told_ns <= i * kPeriod_ns; told_ns += 5'000'000) {
      const double time_s = 1e-9 * static_cast<double>(told_ns);
      Eigen::Vector3d force = plan.force(time_s) + plan.bias_m_s2;
      for (double& value : force) value += plan.noise_m_s2 * random.uniform(-1.7, 1.7);
      force.z() += plan.vibration_m_s2 * std::sin(232.0 * time_s);
      REQUIRE(odometry->add_acceleration(told_ns, plan.unit * force).ok());
      if (plan.gyroscope_rad_s == 0.0) continue;
      REQUIRE(odometry->add_angular_velocity(told_ns, {0.0, 0.0, plan.gyroscope_rad_s}).ok());
    }
    const double now_s = 0.1 * i;
    const SweptScan scan = sweep(
        hall(), [&](double after_s) { return plan.at(now_s + after_s); },
        static_cast<std::uint64_t>(i), plan.columns);
    driven.last = odometry.add(scan);
    const Pose truth = plan.at(now_s);
    if (i == 1) {
      driven.first = driven.last;
      T_level_first = driven.last.T_odometry_sensor * truth.inverse();
    }
    const Pose off = (T_level_first * truth).inverse() * driven.last.T_odometry_sensor;
    driven.worst_m = std::max(driven.worst_m, off.translation.norm());
    const Eigen::Vector3d up = driven.last.T_odometry_sensor.rotation * truth.rotation.transpose() *
                               Eigen::Vector3d::UnitZ();
    driven.worst_tilt_deg = std::max(driven.worst_tilt_deg, tilt_deg(up));
    driven.worst_sigmas =
        std::max(driven.worst_sigmas, (up - driven.last.up).norm() / driven.last.up_sigma_rad);
  }
  driven.statistics = odometry->statistics();
  return driven;
}

/// Stands, sets off at 2 m/s², goes on, brakes.
double stop_and_go(double time_s) {
  const double t = std::max(0.0, time_s - 1.0);
  if (t < 1.0) return t * t;
  if (t < 2.0) return 1.0 + 2.0 * (t - 1.0);
  return 3.0 + 2.0 * (t - 2.0) - std::min(1.0, t - 2.0) * std::min(1.0, t - 2.0) -
         2.0 * std::max(0.0, t - 3.0);
}

}  // namespace

TEST_CASE("an accelerometer levels the first scan of a sensor that is mounted askew") {
  for (const double roll_deg : {25.0, -8.0, 180.0}) {
    const Driven driven = drive({.roll_deg = roll_deg, .scans = 3});
    CAPTURE(roll_deg, driven.worst_tilt_deg);
    CHECK(driven.worst_tilt_deg < 0.3);
    CHECK(std::abs(rotation_angle(driven.first.T_odometry_sensor.rotation) * kDegreesPerRadian -
                   std::abs(roll_deg)) < 0.5);
    CHECK(std::isinf(driven.first.up_sigma_rad));
  }
}

TEST_CASE("without an accelerometer the first pose is the identity and up is not known") {
  const Driven driven = drive({.roll_deg = 10.0, .scans = 3, .is_there = false});
  CHECK(driven.first.T_odometry_sensor.rotation.isIdentity(0.0));
  CHECK(std::isinf(driven.last.up_sigma_rad));
}

TEST_CASE("setting off and braking tilt nothing, and up is as sure as it says") {
  const Driven driven = drive({.roll_deg = 5.0, .way_m = stop_and_go, .scans = 60});
  CAPTURE(driven.worst_tilt_deg, driven.worst_sigmas, driven.last.up_sigma_rad);
  CHECK(driven.worst_tilt_deg < 0.3);
  CHECK(driven.worst_sigmas < 2.0);
  CHECK(driven.last.up_sigma_rad * kDegreesPerRadian < 1.0);
  CHECK(driven.worst_m < 0.05);
}

TEST_CASE("a drive that begins while it accelerates is not bent, and up tells its tilt") {
  const Driven driven =
      drive({.way_m = [](double t) { return t < 2.0 ? 1.5 * t * t : 6.0 * t - 6.0; }, .scans = 55});
  CHECK(driven.worst_tilt_deg > 10.0);  // atan(3 / 9.81)
  CHECK(tilt_deg(driven.last.up) > 10.0);
  CHECK(driven.worst_sigmas < 2.0);
  CHECK(driven.worst_m < 0.1);  // of 27
}

/// An accelerometer on a sensor that stands, by what the scans show, and measures `force(time_s)`.
odometry::Accelerometer standing(std::vector<std::byte>& block, int steps,
                                 const std::function<Eigen::Vector3d(double)>& force) {
  block.resize(1U << 17U);
  Arena arena(block.data(), block.size());
  odometry::Accelerometer accelerometer;
  accelerometer.allocate(arena);
  odometry::Accelerometer::Motion motion;
  for (int i = 0; i < steps; ++i) {
    for (int k = 1; k <= 3; ++k) {
      REQUIRE(accelerometer.add(motion.now_ns + k * 33'000'000, force(0.1 * i)).ok());
    }
    motion.before_ns = motion.now_ns;
    motion.now_ns += kPeriod_ns;
    if (i == 1) static_cast<void>(accelerometer.begin(motion.now_ns));
    if (i > 1) accelerometer.move(motion);
  }
  return accelerometer;
}

Eigen::Vector3d leaning(double angle_deg) {
  const double angle_rad = angle_deg / kDegreesPerRadian;
  return {0.0, kG_m_s2 * std::sin(angle_rad), kG_m_s2 * std::cos(angle_rad)};
}

TEST_CASE("up follows a slow drift of the registered rotations") {
  std::vector<std::byte> block;
  const auto accelerometer = standing(block, 4000, [](double s) { return leaning(0.02 * s); });
  const double left_deg = 8.0 - tilt_deg(accelerometer.up());
  CAPTURE(left_deg);
  CHECK(std::abs(left_deg) < 1.5);
}

TEST_CASE("up is less sure while forces do not fit") {
  std::vector<std::byte> block;
  const auto accelerometer =
      standing(block, 600, [](double s) { return leaning(s < 30.0 ? 0.0 : 20.0); });
  const double sigma_deg = accelerometer.sigma_rad() * kDegreesPerRadian;
  CHECK(20.0 - tilt_deg(accelerometer.up()) < 4.0 * sigma_deg);
}

TEST_CASE("an IMU that takes gravity out tells no up, though it brakes at 1 m/s²") {
  std::vector<std::byte> block;
  const auto accelerometer = standing(block, 100, [](double s) {
    return Eigen::Vector3d(s > 4.0 && s < 7.0 ? 1.0 : 0.0, 0.0, 0.0);
  });
  CHECK_FALSE(accelerometer.is_known());
  CHECK(accelerometer.updates_in_g() == 0);
}

TEST_CASE("a motion that begins where the sensor was lost tells no acceleration") {
  std::vector<std::byte> block(1U << 17U);
  Arena arena(block.data(), block.size());
  odometry::Accelerometer accelerometer;
  accelerometer.allocate(arena);
  odometry::Accelerometer::Motion motion;
  for (int i = 0; i < 60; ++i) {
    for (int k = 1; k <= 3; ++k) {
      REQUIRE(accelerometer.add(motion.now_ns + k * 33'000'000, leaning(0.0)).ok());
    }
    motion.before_ns = motion.now_ns;
    motion.now_ns += kPeriod_ns;
    if (i == 1) static_cast<void>(accelerometer.begin(motion.now_ns));
    if (i == 30) accelerometer.lose(0.1);
    motion.T_map_before.translation.x() = i == 31 ? -2.0 : 0.0;  // as it was foretold
    if (i > 1 && i != 30) accelerometer.move(motion);
  }
  CHECK(tilt_deg(accelerometer.up()) < 0.1);
}

TEST_CASE("what drifts beyond two sigma is taken back") {
  const Driven driven = drive({.drift_deg_s = 0.3, .scans = 200, .columns = 100});
  const Eigen::AngleAxisd drift(6.0 / kDegreesPerRadian, Eigen::Vector3d::UnitX());
  const Eigen::Matrix3d R = driven.last.T_odometry_sensor.rotation;
  CHECK(tilt_deg(R * (drift * Eigen::Vector3d::UnitZ())) < 5.9);
}

TEST_CASE("a tilt within two sigma of the accelerometer changes no pose") {
  Drive plan{.bias_m_s2 = {0.0, 0.1, 0.0}, .way_m = stop_and_go, .scans = 50};
  const Driven with = drive(plan);
  plan.is_there = false;
  const Driven without = drive(plan);
  CAPTURE(with.worst_m, without.worst_m, with.worst_sigmas);
  CHECK(with.worst_m < without.worst_m + 0.01);
  CHECK(with.worst_sigmas < 2.0);
}

TEST_CASE("turning shows the bias of an accelerometer") {
  const Drive still{.bias_m_s2 = {0.1, -0.1, 0.05}, .scans = 60};
  Drive turning = still;
  turning.yaw_rad_s = 1.0;
  const double still_rad = drive(still).last.up_sigma_rad;
  const Driven turned = drive(turning);
  CAPTURE(still_rad, turned.last.up_sigma_rad, turned.worst_sigmas);
  CHECK(turned.last.up_sigma_rad < 0.7 * still_rad);
  CHECK(turned.worst_sigmas < 2.0);
}

TEST_CASE("an IMU whose gyroscope contradicts the scans tells no up") {
  const Driven right = drive({.yaw_rad_s = 1.0, .gyroscope_rad_s = 1.0, .scans = 30});
  CHECK(std::isfinite(right.last.up_sigma_rad));
  CHECK_FALSE(right.statistics.imu_contradicted());
  const Driven wrong = drive({.yaw_rad_s = 1.0, .gyroscope_rad_s = -1.0, .scans = 30});
  CHECK(std::isinf(wrong.last.up_sigma_rad));
  CHECK(wrong.statistics.imu_contradicted());
  CHECK(wrong.statistics.updates_of_up > 0);
}

TEST_CASE("an accelerometer in g is taken in g, and that is counted") {
  const Driven driven =
      drive({.roll_deg = 10.0, .unit = 1.0 / kG_m_s2, .way_m = stop_and_go, .scans = 50});
  CHECK(driven.worst_tilt_deg < 0.3);
  CHECK(driven.worst_sigmas < 2.0);
  CHECK(driven.statistics.updates_in_g == driven.statistics.updates_of_up);
  CHECK(driven.statistics.updates_of_up > 0);
}

TEST_CASE("an accelerometer of zeros or of another unit is not used, and that is counted") {
  for (const double unit : {0.0, 3.0}) {
    const Driven driven = drive({.roll_deg = 10.0, .unit = unit, .noise_m_s2 = 0.0, .scans = 30});
    CHECK(driven.first.T_odometry_sensor.rotation.isIdentity(0.0));
    CHECK(std::isinf(driven.last.up_sigma_rad));
    CHECK(driven.statistics.updates_implausible > 0);
  }
}

TEST_CASE("vibration of an accelerometer makes no pose worse") {
  const Driven driven = drive({.vibration_m_s2 = 10.0, .way_m = stop_and_go, .scans = 50});
  CAPTURE(driven.worst_tilt_deg, driven.worst_sigmas);
  CHECK(driven.worst_tilt_deg < 1.0);
  CHECK(driven.worst_sigmas < 2.0);
  CHECK(driven.worst_m < 0.1);
}

TEST_CASE("accelerations that cannot be are refused and counted") {
  TestOdometry odometry;
  const Eigen::Vector3d rest(0.0, 0.0, kG_m_s2);
  const auto taken = [&](std::int64_t stamp_ns, const Eigen::Vector3d& m_s2) {
    return odometry->add_acceleration(stamp_ns, m_s2).ok();
  };
  CHECK(taken(5, rest));
  CHECK_FALSE(taken(5, rest));
  CHECK_FALSE(taken(6, {std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0}));
  CHECK_FALSE(taken(6, {0.0, -200.0, 0.0}));
  CHECK_FALSE(taken(std::numeric_limits<std::int64_t>::max(), rest));
  CHECK(taken(6, rest));
  CHECK(odometry->statistics().accelerations == 2);
  CHECK(odometry->statistics().accelerations_refused == 4);
}
