// Contradiction of the odometry by the share of dynamic cells
#include "src/onboard/odometry_monitor.hpp"

#include <catch2/catch.hpp>

#include "event_log.hpp"
#include "run.hpp"

using namespace unimapper;
using namespace unimapper::test;
using unimapper::onboard::OdometryMonitor;

namespace {

/// A monitor that has seen keyframes of 40 dynamic cells in a thousand.
OdometryMonitor usual(std::uint32_t keyframes) {
  OdometryMonitor monitor;
  for (std::uint32_t k = 0; k < keyframes; ++k) monitor.add(400, 10'000);
  return monitor;
}

/// Events of a robot that drives along a fence, ten keyframes of three scans; from the seventh on
/// its odometry is off by `off_m` across the fence.
std::vector<EventRecord> drive(double off_m, std::uint32_t& contradicted) {
  EventLog log;
  PipelineConfig config = small_config();
  config.events = log.ring;
  config.keyframe.scans = 3;
  OwnedPipeline pipeline(config);
  REQUIRE(pipeline);
  Scene scene;
  scene.columns = 360;
  for (int i = -4; i < 16; ++i) {
    scene.boxes.push_back(standing_box({3.0 * i, 8.0, 1.5}, {0.4, 0.4, 1.5}));
    scene.boxes.push_back(standing_box({3.0 * i + 1.0, -7.0, 1.0}, {1.0, 0.2, 1.0}));
  }
  contradicted = 0;
  for (int s = 0; s < 30; ++s) {
    const LabelledScan scan = scene.scan(sensor_at(0.3 * s, 0.0), 0.1 * s);
    const Pose given = sensor_at(0.3 * s, s < 18 ? 0.0 : off_m);
    const ScanResult result = pipeline->add_scan(scan.view(), given, kPeriodNs * (s + 1));
    if (result.keyframe_ready) {
      contradicted += pipeline->keyframe().statistics->odometry_contradicted ? 1 : 0;
    }
  }
  return log.take(EventId::kOdometryContradicted);
}

}  // namespace

TEST_CASE(
    "half as many dynamic cells again and a twentieth of all more contradict in two keyframes") {
  for (const std::uint32_t enough : {0U, 1U}) {
    OdometryMonitor monitor = usual(3);
    for (const bool second : {false, true}) {
      monitor.add(1'100 + 10 * enough, 10'000);
      CHECK(monitor.is_contradicted() == (second && enough == 1));
    }
    CHECK(monitor.share() == 110 + enough);
  }
  OdometryMonitor crowd = usual(3);
  for (int k = 0; k < 6; ++k) {
    crowd.add(k % 2 == 0 ? 1'500 : 400, 10'000);
    CHECK_FALSE(crowd.is_contradicted());
  }
}

TEST_CASE("a tenth of all cells more contradicts in one keyframe") {
  for (const std::uint32_t enough : {0U, 1U}) {
    OdometryMonitor monitor = usual(3);
    monitor.add(1'600 + 10 * enough, 10'000);
    CHECK(monitor.is_contradicted() == (enough == 1));
    CHECK(monitor.usual_share() == 40);
  }
}

TEST_CASE("of two keyframes, and of few cells, nothing is concluded") {
  OdometryMonitor monitor = usual(2);
  monitor.add(9'000, 10'000);
  CHECK_FALSE(monitor.is_contradicted());
  monitor = usual(8);
  monitor.add(450, 499);
  CHECK_FALSE(monitor.is_contradicted());
}

TEST_CASE("behind a lift the odometry is contradicted where it did not rise, and in it never") {
  for (const double rise_m : {0.0, 0.9, 1.1, 3.5}) {
    for (const int keyframes : {3, 4, 20}) {
      OdometryMonitor monitor = usual(8);
      for (int k = 0; k < keyframes; ++k) {
        KeyframeScan scan{};
        scan.stamp_ns = 1'000'000'000LL * k;
        scan.T_odometry_sensor.translation.z() = rise_m * k / (keyframes - 1);
        monitor.add_cabin(scan);
        CHECK_FALSE(monitor.is_contradicted());
      }
      monitor.add(3'000, 10'000);
      CHECK(monitor.is_contradicted() == (rise_m < 1.0 && keyframes > 3));
      monitor.add(3'000, 10'000);
      CHECK_FALSE(monitor.is_contradicted());
    }
  }
}

TEST_CASE("a keyframe is shut in where a fiftieth of its cells is farther than a cabin's walls") {
  std::vector<FineCell> near(98, {{0.0F, 3.4F, 9.0F}, 1, 0, 0});
  std::vector<FineCell> far(2, {{0.0F, 3.6F, 0.0F}, 1, 0, 0});
  CHECK(onboard::is_shut_in(near, far));
  CHECK(onboard::is_shut_in(far, near));
  far.push_back(far.back());
  CHECK_FALSE(onboard::is_shut_in(near, far));
}

TEST_CASE("a contradiction ends with the leap, or when what is usual has become another") {
  OdometryMonitor monitor = usual(8);
  monitor.add(3'000, 10'000);
  CHECK(monitor.is_contradicted());
  monitor.add(400, 10'000);
  CHECK_FALSE(monitor.is_contradicted());
  for (int k = 0; k < 9; ++k) {
    monitor.add(3'000, 10'000);
    CHECK(monitor.is_contradicted());
  }
  for (int k = 0; k < 5; ++k) {
    monitor.add(3'000, 10'000);
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
