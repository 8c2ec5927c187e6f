// Hand-eye calibration of mount and clock from given against registered motion
#include "src/input/calibration.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <vector>

#include "src/input/extrinsic.hpp"

using namespace unimapper;
using namespace unimapper::input;
using Catch::Matchers::Contains;

namespace {

constexpr std::size_t kScans = 200;
constexpr double kInterval_s = 0.1;

std::int64_t stamp_of(std::size_t i) { return static_cast<std::int64_t>(i) * 100'000'000; }

/// T_world_base of a drive that turns and changes its speed, or goes straight on.
Pose base_at(double seconds, bool is_straight) {
  Pose pose;
  double yaw = 0.0;
  constexpr double kStep_s = 0.005;
  constexpr double kBegin_s = -3.0;
  const long steps = std::lround((seconds - kBegin_s) / kStep_s);
  for (long k = 0; k < steps; ++k) {
    const double t = kBegin_s + kStep_s * static_cast<double>(k);
    const double speed = is_straight ? 5.0 : 5.0 + 2.0 * std::sin(0.9 * t);
    yaw += is_straight ? 0.0 : kStep_s * 0.4 * std::sin(0.7 * t);
    pose.translation += kStep_s * speed * Eigen::Vector3d(std::cos(yaw), std::sin(yaw), 0.0);
  }
  pose.rotation = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return pose;
}

/// A drive whose given poses lack a mount and come late, and its motions.
struct Drive {
  Pose T_base_lidar;
  double late_s = 0.0;
  bool is_straight = false;
  double attitude_noise_deg = 0.0;  ///< of the given poses
  double motion_noise_m = 0.005;    ///< of the registered motions
  std::size_t wrong_motions = 0;

  [[nodiscard]] Calibration calibrated() const {
    std::mt19937 random(5);  // NOLINT: the same drive every time
    std::normal_distribution<double> normal;
    const auto noise = [&](double sigma) {
      return Eigen::Vector3d(sigma * normal(random), sigma * normal(random),
                             sigma * normal(random));
    };
    std::vector<Pose> given;
    for (std::size_t i = 0; i < kScans; ++i) {
      given.push_back(base_at(static_cast<double>(i) * kInterval_s - late_s, is_straight));
      const Eigen::Vector3d off = noise(attitude_noise_deg / kDegreesPerRadian);
      given.back().rotation *= (Eigen::AngleAxisd(off.x(), Eigen::Vector3d::UnitX()) *
                                Eigen::AngleAxisd(off.y(), Eigen::Vector3d::UnitY()))
                                   .toRotationMatrix();
    }
    std::vector<RegisteredMotion> motions;
    for (std::size_t i = 12; i + 20 < kScans; i += 4) {
      const std::size_t j = i + 6;
      const auto lidar_at = [&](std::size_t k) {
        return base_at(static_cast<double>(k) * kInterval_s, is_straight) * T_base_lidar;
      };
      Pose motion = lidar_at(i).inverse() * lidar_at(j);
      motion.translation += noise(motions.size() < wrong_motions ? 1.0 : motion_noise_m);
      motions.push_back({stamp_of(i), stamp_of(j), motion});
    }
    return calibrate({kScans, [&](std::size_t i) { return given[i]; }, stamp_of}, motions);
  }
};

}  // namespace

TEST_CASE("A right mount and clock are found right", "[calibration]") {
  const Calibration found = Drive{}.calibrated();
  CHECK(found.motions >= 40);
  CHECK(found.shows_rotation());
  CHECK(found.shows_lever_arm());
  CHECK(found.shows_delay());
  CHECK(check_mount(found, {}).severity == Severity::kFine);
  CHECK(check_time(found, 0.0).severity == Severity::kFine);
  CHECK(found.sure_delay_s() == 0.0);
}

TEST_CASE("Yaw, pitch, lever arm and delay are estimated together, of either sign",
          "[calibration]") {
  const double sign = GENERATE(-1.0, 1.0);
  const Drive drive{extrinsic_pose({1.2 * sign, -0.6 * sign, 0.0, 0.0, 1.5 * sign, -2.0 * sign}),
                    0.15 * sign};
  const Calibration found = drive.calibrated();
  CHECK(found.yaw_deg.value == Approx(-2.0 * sign).margin(0.2));
  CHECK(found.pitch_deg.value == Approx(1.5 * sign).margin(0.2));
  CHECK(found.x_m.value == Approx(1.2 * sign).margin(0.1));
  CHECK(found.y_m.value == Approx(-0.6 * sign).margin(0.1));
  CHECK(found.delay_s.value == Approx(0.15 * sign).margin(0.01));

  const Finding mount = check_mount(found, {});
  CHECK(mount.severity == Severity::kWrong);
  CHECK_THAT(mount.message, Contains("--extrinsic "));
  const Finding time = check_time(found, 0.0);
  CHECK(time.severity == Severity::kWrong);
  CHECK_THAT(time.message, Contains(sign > 0.0 ? "0.15 s late" : "0.15 s early") &&
                               Contains(sign > 0.0 ? "--time-offset -0.1" : "--time-offset 0.1"));
}

TEST_CASE("A delay with which the scans agree no better is none", "[calibration]") {
  Calibration found = Drive{Pose{}, -0.5}.calibrated();
  REQUIRE(check_time(found, 0.0).severity == Severity::kWrong);
  leave_out_unseen_delay(found.delay_s, 0.001);
  CHECK(check_time(found, 0.0).severity == Severity::kWrong);
  leave_out_unseen_delay(found.delay_s, 0.0);
  CHECK(check_time(found, 0.0).severity == Severity::kFine);
  CHECK(found.sure_delay_s() == 0.0);
}

TEST_CASE("A height counts from eight standard deviations, as sway looks like one",
          "[calibration]") {
  Calibration found;
  found.motions = 39;
  found.z_m = {1.78, 0.4};
  CHECK(check_mount(found, {}).severity == Severity::kFine);
  CHECK(found.sure_mount().translation.norm() == 0.0);
  found.z_m = {1.78, 0.2};
  CHECK(check_mount(found, {}).severity == Severity::kWrong);
  CHECK(found.sure_mount().translation.z() == 1.78);
  found.z_m = {};
  found.x_m = {1.78, 0.4};
  CHECK(check_mount(found, {}).severity == Severity::kWrong);
}

TEST_CASE("A straight drive shows yaw and pitch, but neither lever arm nor delay",
          "[calibration]") {
  const Drive drive{extrinsic_pose({1.2, 0.0, 0.0, 0.0, 1.0, 2.0}), 0.15, true};
  const Calibration found = drive.calibrated();
  CHECK(found.yaw_deg.value == Approx(2.0).margin(0.2));
  CHECK(found.pitch_deg.value == Approx(1.0).margin(0.2));
  CHECK(found.shows_rotation());
  CHECK_FALSE(found.shows_lever_arm());
  CHECK_FALSE(found.shows_delay());
  CHECK(found.sure_mount().translation.norm() == 0.0);
  CHECK(found.sure_delay_s() == 0.0);
}

TEST_CASE("Noise of the attitude and wrong registrations are no mount and no delay",
          "[calibration]") {
  Drive drive;
  drive.attitude_noise_deg = 0.5;
  drive.motion_noise_m = 0.03;
  drive.wrong_motions = 6;
  const Calibration found = drive.calibrated();
  CHECK(found.motions > 0);
  CHECK(check_mount(found, {}).severity == Severity::kFine);
  CHECK(check_time(found, 0.0).severity == Severity::kFine);
}

TEST_CASE("Remedies go on from the mount and offset that the poses have", "[calibration]") {
  const Calibration found = Drive{extrinsic_pose({0, 0, 0, 0, 0, 3.0}), 0.1}.calibrated();
  const Finding mount = check_mount(found, extrinsic_pose({1.0, 0.0, 2.0, 0.0, 0.0, 90.0}));
  CHECK_THAT(mount.message, Contains("--extrinsic 1.00,0.00,2.00,0.00,0.00,9"));
  CHECK_THAT(check_time(found, -0.2).message, Contains("--time-offset -0.3"));
}

TEST_CASE("Few motions tell nothing", "[calibration]") {
  const Track track{3, [](std::size_t) { return Pose(); }, stamp_of};
  const Calibration found = calibrate(track, {});
  CHECK(found.motions == 0);
  CHECK(check_mount(found, {}).severity == Severity::kFine);
  CHECK(check_time(found, 0.0).severity == Severity::kFine);
}
