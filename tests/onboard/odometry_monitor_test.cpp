// Contradiction of the odometry by the share of dynamic cells
#include "src/onboard/odometry_monitor.hpp"

#include "event_log.hpp"
#include "run.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::test;
using unimapper::onboard::OdometryMonitor;

namespace {

/// A monitor that has seen keyframes of 40 dynamic cells in a thousand.
OdometryMonitor usual(std::uint32_t keyframes) {
  OdometryMonitor monitor;
  for (std::uint32_t k = 0; k < keyframes; ++k) monitor.add(400, 10'000, 0.0);
  return monitor;
}

/// A robot with a keyframe of three scans, and what it says of its odometry.
struct Robot {
  EventLog log;
  std::optional<OwnedPipeline> pipeline;
  int scans = 0;
  std::uint32_t contradicted = 0;  ///< keyframes

  Robot() {
    PipelineConfig config = small_config();
    config.events = log.ring;
    config.keyframe.scans = 3;
    pipeline.emplace(config);
    REQUIRE(*pipeline);
  }
  void add(const Scene& scene, const Pose& truth, const Pose& given) {
    const LabelledScan scan = scene.scan(truth, 0.1 * scans);
    if (!(*pipeline)->add_scan(scan.view(), given, kPeriodNs * ++scans).keyframe_ready) return;
    contradicted += (*pipeline)->keyframe().odometry_contradicted ? 1 : 0;
  }
};

Scene fence() {
  Scene scene;
  scene.columns = 360;
  for (int i = -4; i < 16; ++i) {
    scene.boxes.push_back(standing_box({3.0 * i, 8.0, 1.5}, {0.4, 0.4, 1.5}));
    scene.boxes.push_back(standing_box({3.0 * i + 1.0, -7.0, 1.0}, {1.0, 0.2, 1.0}));
  }
  return scene;
}

/// Four walls so far from the middle.
Scene closed_at(double x, double half_m) {
  Scene scene;
  scene.columns = 360;
  for (const double side : {-half_m, half_m}) {
    scene.boxes.push_back(standing_box({x + side, 0.0, 1.5}, {0.1, half_m + 0.1, 1.5}));
    scene.boxes.push_back(standing_box({x, side, 1.5}, {half_m + 0.1, 0.1, 1.5}));
  }
  return scene;
}

/// Events of a robot that drives along a fence, ten keyframes; from the seventh on its odometry is
/// off by `off_m` across the fence.
std::vector<EventRecord> drive(double off_m, std::uint32_t& contradicted) {
  Robot robot;
  const Scene scene = fence();
  for (int s = 0; s < 30; ++s) {
    robot.add(scene, sensor_at(0.3 * s, 0.0), sensor_at(0.3 * s, s < 18 ? 0.0 : off_m));
  }
  contradicted = robot.contradicted;
  return robot.log.take(EventId::kOdometryContradicted);
}

/// How many keyframes are contradicted where a robot drives to and fro in a room, and its odometry
/// jumps by `off_m` to the side half way.
std::uint32_t contradicted_in_room(double off_m) {
  Robot robot;
  Scene room = closed_at(0.0, 2.2);
  room.boxes.push_back(standing_box({1.6, 1.2, 0.5}, {0.3, 0.4, 0.5}));
  room.boxes.push_back(standing_box({-1.0, -1.7, 0.4}, {0.5, 0.3, 0.4}));
  for (int s = 0; s < 60; ++s) {
    const double x = 0.9 * std::sin(0.2 * s);
    robot.add(room, sensor_at(x, 0.0), sensor_at(x, s < 42 ? 0.0 : off_m));
  }
  return robot.contradicted;
}

/// Events of a robot that takes a lift, whose odometry rises by `felt_m` meanwhile.
std::vector<EventRecord> ride(double felt_m) {
  Robot robot;
  const auto given = [](double x, double z_m) {
    Pose pose = sensor_at(x, 0.0);
    pose.translation.z() += z_m;
    return pose;
  };
  for (int s = 0; s < 15; ++s) {
    robot.add(fence(), sensor_at(0.3 * s, 0.0), given(0.3 * s, 0.0));
  }
  for (int s = 0; s < 36; ++s) {
    robot.add(closed_at(4.5, 1.6), sensor_at(4.5, 0.0), given(4.5, felt_m * s / 35.0));
  }
  for (int s = 0; s < 6; ++s) {
    robot.add(fence(), sensor_at(4.5 + 0.3 * s, 0.0), given(4.5 + 0.3 * s, felt_m));
  }
  return robot.log.take(EventId::kOdometryContradicted);
}

}  // namespace

TEST_CASE(
    "half as many dynamic cells again and a twentieth of all more contradict in two keyframes") {
  for (const std::uint32_t enough : {0U, 1U}) {
    OdometryMonitor monitor = usual(3);
    for (const bool second : {false, true}) {
      monitor.add(1'100 + 10 * enough, 10'000, 0.0);
      CHECK(monitor.is_contradicted() == (second && enough == 1));
    }
    CHECK(monitor.share() == 110 + enough);
  }
  OdometryMonitor crowd = usual(3);
  for (int k = 0; k < 6; ++k) {
    crowd.add(k % 2 == 0 ? 1'500 : 400, 10'000, 0.0);
    CHECK_FALSE(crowd.is_contradicted());
  }
}

TEST_CASE("a tenth of all cells more contradicts in one keyframe") {
  for (const std::uint32_t enough : {0U, 1U}) {
    OdometryMonitor monitor = usual(3);
    monitor.add(1'600 + 10 * enough, 10'000, 0.0);
    CHECK(monitor.is_contradicted() == (enough == 1));
    CHECK(monitor.usual_share() == 40);
  }
}

TEST_CASE("of two keyframes, and of few cells, nothing is concluded") {
  OdometryMonitor monitor = usual(2);
  monitor.add(9'000, 10'000, 0.0);
  CHECK_FALSE(monitor.is_contradicted());
  monitor = usual(8);
  monitor.add(450, 499, 0.0);
  CHECK_FALSE(monitor.is_contradicted());
}

TEST_CASE("behind a lift the odometry is contradicted where it did not rise, and in it never") {
  for (const double rise_m : {0.0, 1.4, 2.3, -3.5}) {
    for (const int keyframes : {3, 4, 20}) {
      for (const bool enters : {true, false}) {
        OdometryMonitor monitor = usual(enters ? 8 : 0);
        for (int k = 0; k < keyframes; ++k) {
          KeyframeScan scan{};
          scan.stamp_ns = 1'000'000'000LL * k;
          // A part of the ride lies between the keyframes inside and those outside.
          scan.T_odometry_sensor.translation.z() = rise_m * (k + 1) / (keyframes + 1);
          monitor.add_shut_in(scan, 9'000, 10'000);
          CHECK_FALSE(monitor.is_contradicted());
        }
        // Behind a ride all is new.
        const std::uint32_t dynamic = keyframes > 3 ? 3'000 : 400;
        monitor.add(dynamic, 10'000, rise_m);
        // Who starts in a small room has been on no other storey.
        CHECK(monitor.is_contradicted() == (enters && std::abs(rise_m) < 2.0 && keyframes > 3));
        monitor.add(dynamic, 10'000, rise_m);
        CHECK_FALSE(monitor.is_contradicted());
      }
    }
  }
}

TEST_CASE("who drives while shut in is in a room: no lift, and what is there counts") {
  for (const double driven_m : {1.4, 1.6}) {
    OdometryMonitor monitor = usual(8);
    const bool is_room = driven_m > 1.5;
    KeyframeScan scan{};
    for (int k = 0; k < 8; ++k) {
      scan.stamp_ns = 1'000'000'000LL * k;
      scan.T_odometry_sensor.translation.x() = k == 0 ? 0.0 : driven_m;
      monitor.add_shut_in(scan, 400, 10'000);
      CHECK_FALSE(monitor.is_contradicted());
    }
    OdometryMonitor jumps = monitor;
    jumps.add_shut_in(scan, 3'000, 10'000);
    CHECK(jumps.is_contradicted() == is_room);
    monitor.add(400, 10'000, 0.0);
    CHECK(monitor.is_contradicted() != is_room);
  }
}

TEST_CASE("a keyframe is shut in where cells surround it, all but a fiftieth within a cabin") {
  std::vector<FineCell> near;
  for (int i = 0; i < 392; ++i) {
    const auto turn = static_cast<float>(2.0 * M_PI / 392.0 * i);
    near.push_back({{3.4F * std::cos(turn), 3.4F * std::sin(turn), 9.0F}, 1, 0, 0});
  }
  std::vector<FineCell> far(8, {{0.0F, 3.6F, 0.0F}, 1, 0, 0});
  CHECK(onboard::is_shut_in(near, far));
  CHECK(onboard::is_shut_in(far, near));
  far.push_back(far.back());
  CHECK_FALSE(onboard::is_shut_in(near, far));
  // A narrow view of a wall is no cabin.
  near.resize(near.size() / 2);
  CHECK_FALSE(onboard::is_shut_in(near, {}));
}

TEST_CASE("a contradiction ends with the leap, or when what is usual has become another") {
  OdometryMonitor monitor = usual(8);
  monitor.add(3'000, 10'000, 0.0);
  CHECK(monitor.is_contradicted());
  monitor.add(400, 10'000, 0.0);
  CHECK_FALSE(monitor.is_contradicted());
  for (int k = 0; k < 9; ++k) {
    monitor.add(3'000, 10'000, 0.0);
    CHECK(monitor.is_contradicted());
  }
  for (int k = 0; k < 5; ++k) {
    monitor.add(3'000, 10'000, 0.0);
    CHECK_FALSE(monitor.is_contradicted());
  }
}

TEST_CASE("a pipeline tells within two keyframes that its odometry has jumped, and only then") {
  std::uint32_t contradicted = 0;
  CHECK(drive(0.0, contradicted).empty());
  CHECK(contradicted == 0);
  const std::vector<EventRecord> events = drive(1.2, contradicted);
  REQUIRE(events.size() == 1);
  CHECK(contradicted > 0);
  CHECK(events[0].values[2] >= 6);
  CHECK(events[0].values[2] <= 7);
  CHECK(events[0].values[0] > events[0].values[1]);
}

TEST_CASE("a pipeline tells of a jump in a small room, and of a right odometry nothing") {
  CHECK(contradicted_in_room(0.0) == 0);
  CHECK(contradicted_in_room(1.0) > 0);
}

TEST_CASE("a pipeline tells behind a lift that its odometry did not rise") {
  CHECK(ride(3.5).empty());
  const std::vector<EventRecord> events = ride(0.0);
  REQUIRE(events.size() == 1);
  CHECK(events[0].values[0] == 0);
  CHECK(events[0].values[1] == 0);
  CHECK(events[0].stamp_ns == 54 * kPeriodNs);  // the first keyframe outside
}
