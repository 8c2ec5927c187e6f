// Mount, clock, scale and axes of the poses, as the pipeline says them while the robot drives
#include "src/onboard/calibration/calibration_monitor.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <memory>
#include <vector>

#include "event_log.hpp"
#include "run.hpp"
#include "src/core/known_mistake.hpp"
#include "tests/test.hpp"
#include "unimapper/core/owned.hpp"

using namespace unimapper;
using namespace unimapper::test;
using Catch::Matchers::WithinAbs;
using onboard::CalibrationMonitor;

namespace {

Pose turned(double degrees, const Eigen::Vector3d& axis) {
  return {Eigen::AngleAxisd(degrees / kDegreesPerRadian, axis).toRotationMatrix(),
          Eigen::Vector3d::Zero()};
}

/// A hall with two boxes: points of its surfaces, 0.35 m apart.
std::vector<Eigen::Vector3d> hall() {
  std::vector<Eigen::Vector3d> points;
  const auto surface = [&](const Eigen::Vector3d& corner, const Eigen::Vector3d& u,
                           const Eigen::Vector3d& v) {
    constexpr double kStep_m = 0.35;
    for (double a = 0.0; a <= u.norm(); a += kStep_m) {
      for (double b = 0.0; b <= v.norm(); b += kStep_m) {
        points.emplace_back(corner + a * u.normalized() + b * v.normalized());
      }
    }
  };
  const Eigen::Vector3d x(24.0, 0.0, 0.0);
  const Eigen::Vector3d y(0.0, 16.0, 0.0);
  const Eigen::Vector3d z(0.0, 0.0, 4.0);
  const Eigen::Vector3d corner(-12.0, -8.0, 0.0);
  surface(corner, x, y);
  for (const Eigen::Vector3d& side : {corner, Eigen::Vector3d(corner + y)}) surface(side, x, z);
  for (const Eigen::Vector3d& side : {corner, Eigen::Vector3d(corner + x)}) surface(side, y, z);
  surface({-3.0, 5.0, 0.0}, 0.2 * x, z);
  surface({4.0, -6.0, 0.0}, 0.2 * y, z);
  return points;
}

/// Where the sensor is: it winds through the hall, now faster, now slower.
Pose place_at(double seconds) {
  const double along = 0.25 * seconds + 0.1 * std::sin(0.8 * seconds);
  const double yaw = 1.57 + along + 0.3 * std::cos(2.0 * along);
  return {turned(yaw * kDegreesPerRadian, Eigen::Vector3d::UnitZ()).rotation,
          Eigen::Vector3d(7.0 * std::cos(along), 4.0 * std::sin(along), 1.2)};
}

std::vector<float> scan_from(const std::vector<Eigen::Vector3d>& points, const Pose& sensor) {
  const Pose inverse = sensor.inverse();
  std::vector<float> scan;
  for (const Eigen::Vector3d& point : points) {
    const Eigen::Vector3d p = inverse * point;
    for (int c = 0; c < 3; ++c) scan.push_back(static_cast<float>(p[c]));
  }
  return scan;
}

using Given = std::function<Pose(double seconds)>;

constexpr int kScans = 300;
constexpr double kInterval_s = 0.1;

/// A scan every tenth of a second, the same for all poses that come with them.
const std::vector<std::vector<float>>& scans() {
  static const std::vector<std::vector<float>> kAll = [] {
    std::vector<std::vector<float>> all;
    const std::vector<Eigen::Vector3d> points = hall();
    for (int i = 0; i < kScans; ++i) all.push_back(scan_from(points, place_at(kInterval_s * i)));
    return all;
  }();
  return kAll;
}

PointView scan(int i) {
  const std::vector<float>& values = scans()[static_cast<std::size_t>(i)];
  return PointView::xyz(values.data(), values.size() / 3, 3 * sizeof(float));
}

/// The monitor after a drive with such poses; keyframes of ten scans.
struct Watched {
  MemoryBlock memory;
  std::unique_ptr<CalibrationMonitor> monitor = std::make_unique<CalibrationMonitor>();

  explicit Watched(const Given& given) {
    const PipelineConfig config;
    Arena measuring = Arena::measuring();
    monitor->allocate(measuring, config);
    memory = MemoryBlock(measuring.used());
    Arena arena(memory.data(), memory.size());
    monitor->allocate(arena, config);
    for (int i = 0; i < kScans; ++i) {
      monitor->add_scan(scan(i), given(kInterval_s * i), kPeriodNs * i);
      while (i % 10 == 9 && monitor->step()) {
      }
    }
  }

  [[nodiscard]] bool says_only(CalibrationMonitor::Part part) const {
    return monitor->said() == 1U << part;
  }
  [[nodiscard]] double value(CalibrationMonitor::Part part) const {
    return monitor->estimate(part).value;
  }
};

/// Poses that lack a mount.
Given without(const Pose& mount) {
  return [mount](double seconds) { return place_at(seconds) * mount.inverse(); };
}

}  // namespace

TEST_CASE("of right poses the monitor says nothing, and knows that they are") {
  const Watched right(place_at);
  CHECK(right.monitor->said() == 0);
  CHECK(right.monitor->pairs() >= 10);
  CHECK(right.monitor->found().shows_rotation());
  CHECK(right.monitor->found().shows_delay());
}

TEST_CASE("a mount that is off is said with the angle or the lever arm") {
  const Watched yaw(without(turned(2.0, Eigen::Vector3d::UnitZ())));
  CHECK(yaw.says_only(CalibrationMonitor::kYaw));
  CHECK_THAT(yaw.value(CalibrationMonitor::kYaw), WithinAbs(2.0, 0.3));
  const Watched pitch(without(turned(-2.0, Eigen::Vector3d::UnitY())));
  CHECK(pitch.says_only(CalibrationMonitor::kPitch));
  CHECK_THAT(pitch.value(CalibrationMonitor::kPitch), WithinAbs(-2.0, 0.3));
  Pose arm;
  arm.translation.x() = 1.2;
  const Watched forward(without(arm));
  CHECK(forward.says_only(CalibrationMonitor::kX));
  CHECK_THAT(forward.value(CalibrationMonitor::kX), WithinAbs(1.2, 0.1));
}

TEST_CASE("half a degree of yaw is not said") {
  const Watched little(without(turned(0.5, Eigen::Vector3d::UnitZ())));
  CHECK(little.monitor->said() == 0);
  CHECK_THAT(little.value(CalibrationMonitor::kYaw), WithinAbs(0.5, 0.3));
}

TEST_CASE("poses that are late are said with the delay, half a scan is not") {
  for (const double late_s : {0.15, 0.05}) {
    const Watched late([late_s](double seconds) { return place_at(seconds - late_s); });
    CHECK((late.says_only(CalibrationMonitor::kDelay)) == (late_s > 0.1));
    CHECK_THAT(late.value(CalibrationMonitor::kDelay), WithinAbs(late_s, 0.02));
  }
}

TEST_CASE("motions that are a tenth too long, and positions in millimetres, are said") {
  const auto scaled = [](double scale) {
    return [scale](double seconds) {
      Pose pose = place_at(seconds);
      pose.translation *= scale;
      return pose;
    };
  };
  const Watched longer(scaled(1.1));
  CHECK(longer.says_only(CalibrationMonitor::kScale));
  const Watched millimetres(scaled(1000.0));
  CHECK(millimetres.says_only(CalibrationMonitor::kMotion));
  CHECK(millimetres.monitor->mistake() == KnownMistake::kMillimetres);
}

TEST_CASE("inverted poses and those of a camera are said as such") {
  const Watched inverted([](double seconds) { return place_at(seconds).inverse(); });
  CHECK(inverted.says_only(CalibrationMonitor::kMotion));
  CHECK(inverted.monitor->mistake() == KnownMistake::kInverted);
  const Pose axes(axes_of(KnownMistake::kCameraAxes), Eigen::Vector3d::Zero());
  const Watched camera(
      [&axes](double seconds) { return axes * place_at(seconds) * axes.inverse(); });
  CHECK(camera.says_only(CalibrationMonitor::kMotion));
  CHECK(camera.monitor->mistake() == KnownMistake::kCameraAxes);
}

TEST_CASE("a pipeline tells it as an event, at once and in slices alike") {
  const Given given = without(turned(3.0, Eigen::Vector3d::UnitZ()));
  std::vector<EventRecord> told[2];
  for (const bool deferred : {false, true}) {
    EventLog log;
    PipelineConfig config = small_config();
    config.events = log.ring;
    config.keyframe.scans = 10;
    config.deferred = deferred;
    OwnedPipeline pipeline(config);
    REQUIRE(pipeline);
    for (int i = 0; i < kScans; ++i) {
      (void)pipeline->add_scan(scan(i), given(kInterval_s * i), kPeriodNs * i);
      for (const EventRecord& record : log.take(EventId::kMountContradicted)) {
        told[deferred ? 1 : 0].push_back(record);
      }
    }
  }
  REQUIRE(told[0].size() == 1);
  REQUIRE(told[1].size() == 1);
  for (std::size_t k = 0; k < 4; ++k) CHECK(told[0][0].values[k] == told[1][0].values[k]);
  CHECK(told[0][0].stamp_ns == told[1][0].stamp_ns);
  CHECK(told[0][0].values[0] == CalibrationMonitor::kYaw);
  CHECK_THAT(1e-3 * static_cast<double>(told[0][0].values[1]), WithinAbs(3.0, 0.3));
}
