// Hand-eye calibration of mount and clock from given against registered motion
#include "src/input/calibration.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "src/input/calibration_findings.hpp"
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

/// What a recording and its registrations say of a drive.
struct Recorded {
  std::vector<Pose> given;
  std::vector<RegisteredMotion> motions;

  [[nodiscard]] Track track() const {
    return {given.size(), [this](std::size_t i) { return given[i]; }, stamp_of};
  }
};

/// A drive whose given poses lack a mount and come late, and its motions.
struct Drive {
  Pose T_base_lidar;
  double late_s = 0.0;
  bool is_straight = false;
  double attitude_noise_deg = 0.0;  ///< of the given poses
  double motion_noise_m = 0.005;    ///< of the registered motions
  std::size_t wrong_motions = 0;
  double sway_deg = 0.0;  ///< of the robot
  double step_s = 0.0;    ///< that the given poses are later from half way on
  double drift_s = 0.0;   ///< by which they come later from the first to the last one
  unsigned seed = 5;

  [[nodiscard]] Pose at(double seconds) const {
    const double sway = sway_deg / kDegreesPerRadian;
    Pose pose = base_at(seconds, is_straight);
    pose.rotation *= (Eigen::AngleAxisd(sway * std::sin(2.0 * seconds), Eigen::Vector3d::UnitX()) *
                      Eigen::AngleAxisd(sway * std::sin(3.1 * seconds), Eigen::Vector3d::UnitY()))
                         .toRotationMatrix();
    return pose;
  }

  [[nodiscard]] Calibration calibrated() const {
    const Recorded recorded = record();
    return calibrate(recorded.track(), recorded.motions);
  }

  [[nodiscard]] Recorded record() const {
    std::mt19937 random(seed);  // NOLINT: the same drive every time
    std::normal_distribution<double> normal;
    const auto noise = [&](double sigma) {
      return Eigen::Vector3d(sigma * normal(random), sigma * normal(random),
                             sigma * normal(random));
    };
    std::vector<Pose> given;
    for (std::size_t i = 0; i < kScans; ++i) {
      const double step =
          (2 * i >= kScans ? step_s : 0.0) + drift_s * static_cast<double>(i) / kScans;
      given.push_back(at(static_cast<double>(i) * kInterval_s - late_s - step));
      const Eigen::Vector3d off = noise(attitude_noise_deg / kDegreesPerRadian);
      given.back().rotation *= (Eigen::AngleAxisd(off.x(), Eigen::Vector3d::UnitX()) *
                                Eigen::AngleAxisd(off.y(), Eigen::Vector3d::UnitY()))
                                   .toRotationMatrix();
    }
    std::vector<RegisteredMotion> motions;
    for (std::size_t i = 12; i + 20 < kScans; i += 4) {
      const std::size_t j = i + 6;
      const auto lidar_at = [&](std::size_t k) {
        return at(static_cast<double>(k) * kInterval_s) * T_base_lidar;
      };
      Pose motion = lidar_at(i).inverse() * lidar_at(j);
      motion.translation += noise(motions.size() < wrong_motions ? 1.0 : motion_noise_m);
      motions.push_back({stamp_of(i), stamp_of(j), motion});
    }
    return {std::move(given), std::move(motions)};
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
  CHECK(found.is_surely_right());
}

TEST_CASE("What half of the motions make likely is not surely right", "[calibration]") {
  const Drive drive = GENERATE(
      Drive{extrinsic_pose({0.0, 0.0, 0.0, 0.0, 0.0, 0.6})}, Drive{Pose{}, 0.06},
      Drive{extrinsic_pose({0.3, 0.0, 0.0, 0.0, 0.0, 0.0})}, Drive{Pose{}, 0.0, false, 0.5});
  Recorded recorded = drive.record();
  CHECK_FALSE(calibrate(recorded.track(), recorded.motions).is_surely_right());
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

namespace {

MotionMistake mistake_in(const Recorded& recorded) {
  const Track track = recorded.track();
  return find_motion_mistake(track, recorded.motions,
                             known_mistakes(track, [](std::size_t i) { return std::to_string(i); }),
                             calibrate(track, recorded.motions));
}

}  // namespace

TEST_CASE("Noise of the attitude is said; it is no mount, no delay and no mirrored axis",
          "[calibration]") {
  Drive drive;
  drive.attitude_noise_deg = GENERATE(0.5, 1.0);
  drive.motion_noise_m = 0.02;
  drive.is_straight = GENERATE(false, true);
  drive.seed = GENERATE(1U, 28U, 55U);  // one of them had each before
  const Recorded recorded = drive.record();
  const Calibration found = calibrate(recorded.track(), recorded.motions);
  CHECK(found.motions > 0);
  CHECK(check_mount(found, {}).message.empty());
  CHECK(check_time(found, 0.0).message.empty());
  CHECK(mistake_in(recorded).names.empty());
  const Finding attitude = check_attitude(found);
  CHECK(attitude.severity == Severity::kSuspicious);
  CHECK(attitude.figure == Approx(drive.attitude_noise_deg).epsilon(0.25));
  CHECK_THAT(attitude.message, Contains("roll and pitch of the poses scatter by "));
}

TEST_CASE("Noise of the attitude hides no yaw, pitch, lever arm and delay", "[calibration]") {
  Drive drive{extrinsic_pose({1.0, 0.0, 0.0, 0.0, 2.0, -2.0}), 0.15};
  drive.attitude_noise_deg = 0.5;
  drive.motion_noise_m = 0.02;
  const Calibration found = drive.calibrated();
  CHECK(check_mount(found, {}).severity == Severity::kWrong);
  CHECK(found.sure_delay_s() == Approx(0.15).margin(0.02));
  CHECK(found.yaw_deg.value == Approx(-2.0).margin(0.2));
  CHECK(found.pitch_deg.value == Approx(2.0).margin(0.4));
  CHECK(found.x_m.value == Approx(1.0).margin(0.15));
}

TEST_CASE("A robot that sways as its scans do has no noise", "[calibration]") {
  Drive drive;
  drive.sway_deg = 6.0;
  const Calibration found = drive.calibrated();
  CHECK(check_attitude(found).severity == Severity::kFine);
}

TEST_CASE("Points that are mirrored along an axis are told, on a straight road as well",
          "[calibration]") {
  struct Mirror {
    Eigen::Vector3d signs;
    const char* name;
  };
  const Mirror mirror =
      GENERATE(Mirror{{1, -1, 1}, "left-handed"}, Mirror{{-1, 1, 1}, "mirrored x"},
               Mirror{{1, 1, -1}, "mirrored z"});
  Drive drive;
  drive.is_straight = GENERATE(false, true);
  drive.sway_deg = 1.0;
  Recorded recorded = drive.record();
  for (RegisteredMotion& motion : recorded.motions) {
    Pose& moved = motion.T_first_second;
    moved.rotation = mirror.signs.asDiagonal() * moved.rotation * mirror.signs.asDiagonal();
    moved.translation = mirror.signs.asDiagonal() * moved.translation;
  }
  const MotionMistake found = mistake_in(recorded);
  CHECK(found.is_better_than_delay);
  REQUIRE_FALSE(found.names.empty());
  CHECK(found.names.front() == mirror.name);
  const Finding finding = check_motion_mistake(found);
  CHECK(finding.severity == Severity::kWrong);
  CHECK_THAT(finding.message, Contains("handedness") && Contains("negate"));
}

TEST_CASE("A clock that steps half way is found, with both delays", "[calibration]") {
  Drive drive;
  drive.late_s = GENERATE(0.0, 0.15);
  drive.step_s = GENERATE(-0.5, 0.2, 1.0);
  const Recorded recorded = drive.record();
  const auto found = find_clock_step(recorded.track(), recorded.motions);
  REQUIRE(found.has_value());
  CHECK(found->is_sure);
  CHECK(found->before_s == Approx(drive.late_s).margin(0.03));
  CHECK(found->after_s == Approx(drive.late_s + drive.step_s).margin(0.03));
  CHECK_FALSE(found->is_drift);
  CHECK(found->scan >= kScans / 2 - 15);
  CHECK(found->scan <= kScans / 2 + 15);
  const Finding finding = check_clock_step(found, 0.0);
  CHECK(finding.severity == Severity::kWrong);
  CHECK_THAT(finding.message, Contains("near scan ") && Contains("split the recording"));
}

TEST_CASE("Clocks that drift apart are no step", "[calibration]") {
  Drive drive;
  drive.drift_s = GENERATE(-0.5, 0.4);
  const Recorded recorded = drive.record();
  const auto found = find_clock_step(recorded.track(), recorded.motions);
  REQUIRE(found.has_value());
  CHECK(found->is_sure);
  CHECK(found->is_drift);
  CHECK(found->after_s - found->before_s == Approx(0.8 * drive.drift_s).margin(0.06));
  CHECK_THAT(check_clock_step(found, 0.0).message, Contains("drift apart"));
}

TEST_CASE("One delay, a mount that is off and wrong registrations are no clock that steps",
          "[calibration]") {
  Drive noisy;
  noisy.attitude_noise_deg = 0.5;
  noisy.motion_noise_m = 0.03;
  noisy.wrong_motions = 8;
  const Drive drive = GENERATE_COPY(Drive{}, Drive{Pose{}, 0.3}, Drive{Pose{}, 0.0, true}, noisy,
                                    Drive{extrinsic_pose({1.2, -0.6, 0.0, 0.0, 1.5, -5.0})});
  const Recorded recorded = drive.record();
  const auto found = find_clock_step(recorded.track(), recorded.motions);
  CHECK_FALSE(found.has_value());
  CHECK(check_clock_step(found, 0.0).severity == Severity::kFine);
}

TEST_CASE("Noise of the attitude is no clock that steps", "[calibration]") {
  Drive drive;
  drive.is_straight = true;
  drive.attitude_noise_deg = 0.7;
  drive.seed = GENERATE(36U, 38U, 89U);  // of a hundred those that looked like a step before
  const Recorded recorded = drive.record();
  CHECK(check_clock_step(find_clock_step(recorded.track(), recorded.motions), 0.0).severity ==
        Severity::kFine);
}

TEST_CASE("Noise of the attitude hides no clock that steps", "[calibration]") {
  Drive drive;
  drive.attitude_noise_deg = 0.7;
  drive.step_s = GENERATE(-0.5, 0.3);
  const Recorded recorded = drive.record();
  const auto found = find_clock_step(recorded.track(), recorded.motions);
  REQUIRE(found.has_value());
  CHECK(found->is_sure);
  CHECK(found->after_s - found->before_s == Approx(drive.step_s).margin(0.06));
}

TEST_CASE("Poses that are right, late or of a mount that is off are no known mistake",
          "[calibration]") {
  const Drive drive = GENERATE(Drive{}, Drive{Pose{}, 0.15}, Drive{Pose{}, 0.0, true},
                               Drive{extrinsic_pose({1.2, -0.6, 0.0, 0.0, 1.5, -5.0})});
  const MotionMistake found = mistake_in(drive.record());
  CHECK(found.names.empty());
  CHECK(check_motion_mistake(found).severity == Severity::kFine);
}

TEST_CASE("Few motions tell nothing", "[calibration]") {
  const Track track{3, [](std::size_t) { return Pose(); }, stamp_of};
  const Calibration found = calibrate(track, {});
  CHECK(found.motions == 0);
  CHECK_FALSE(found.is_surely_right());
  CHECK(check_mount(found, {}).severity == Severity::kFine);
  CHECK(check_time(found, 0.0).severity == Severity::kFine);
}
