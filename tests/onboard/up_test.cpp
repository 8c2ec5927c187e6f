// Up in the pipeline: the keyframe's frame is levelled by walls, not by the odometry's z axis
#include "event_log.hpp"
#include "run.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::test;

namespace {

/// Houses on both sides of a street and across it.
Scene street_of_houses() {
  Scene scene;
  scene.boxes = {standing_box({0.0, 12.0, 3.0}, {9.0, 2.0, 3.0}),
                 standing_box({22.0, 12.0, 4.0}, {8.0, 2.0, 4.0}),
                 standing_box({5.0, -10.0, 3.5}, {12.0, 2.0, 3.5}),
                 standing_box({-20.0, 0.0, 4.0}, {2.0, 8.0, 4.0}),
                 standing_box({40.0, 0.0, 5.0}, {2.0, 9.0, 5.0})};
  return scene;
}

Pose tilted(double roll_deg, double pitch_deg) {
  Pose pose;
  pose.rotation = (Eigen::AngleAxisd(pitch_deg / kDegreesPerRadian, Eigen::Vector3d::UnitY()) *
                   Eigen::AngleAxisd(roll_deg / kDegreesPerRadian, Eigen::Vector3d::UnitX()))
                      .toRotationMatrix();
  return pose;
}

/// Up and frame of each keyframe.
struct Found {
  KeyframeUp up;
  KeyframeStatistics statistics;
  double error_deg = 0.0;  ///< of the frame's z axis
};

std::vector<Found> drive(const Scene& scene, const PipelineConfig& config,
                         const Pose& T_odometry_scene, int scans = 40) {
  OwnedPipeline pipeline(config);
  std::vector<Found> found;
  for (int i = 0; i < scans; ++i) {
    const Pose T_scene_sensor = sensor_at(0.3 * i, 0.0);
    const LabelledScan scan = scene.scan(T_scene_sensor, 0.1 * i);
    const ScanResult result =
        pipeline->add_scan(scan.view(), T_odometry_scene * T_scene_sensor, 1 + i * kPeriodNs);
    REQUIRE(result.error.code == ErrorCode::kOk);
    if (!result.keyframe_ready) continue;
    const KeyframeView& view = pipeline->keyframe();
    const double z =
        view.T_odometry_keyframe.rotation.col(2).cross(T_odometry_scene.rotation.col(2)).norm();
    CHECK(view.T_odometry_keyframe.is_rigid(1e-9));
    found.push_back({view.up, *view.statistics, std::asin(z) * kDegreesPerRadian});
  }
  return found;
}

}  // namespace

TEST_CASE("a tilted odometry's keyframes are level among houses") {
  for (const Pose& tilt : {tilted(0.0, 0.0), tilted(5.0, 0.0), tilted(-6.0, 8.0)}) {
    const auto found = drive(street_of_houses(), small_config(), tilt);
    REQUIRE(found.size() == 4);
    const double tilt_deg = std::acos(tilt.rotation(2, 2)) * kDegreesPerRadian;
    for (const Found& keyframe : found) {
      CHECK(keyframe.up.known);
      CHECK(keyframe.error_deg < 0.5);
      CHECK(keyframe.up.variance_x > 0.0F);
      CHECK(keyframe.up.variance_y > 0.0F);
      CHECK(keyframe.statistics.up_known);
      CHECK(keyframe.statistics.walls > 20);
      CHECK(keyframe.statistics.odometry_tilt_deg == Approx(tilt_deg).margin(0.5));
    }
  }
}

TEST_CASE("on an open field up is unknown and the frame is the odometry's") {
  const Scene field;
  const Pose tilt = tilted(3.0, 0.0);
  for (const Found& keyframe : drive(field, small_config(), tilt, 20)) {
    CHECK(keyframe.up == KeyframeUp{});
    CHECK(keyframe.error_deg == Approx(3.0).margin(1e-6));
    CHECK(keyframe.statistics.odometry_tilt_deg == 0.0F);
  }
}

TEST_CASE("after a restart elsewhere up is not taken over") {
  OwnedPipeline pipeline(small_config());
  const Scene street = street_of_houses();
  const Scene field;
  std::vector<bool> known;
  std::int64_t stamp_ns = 0;
  const auto add = [&](const Scene& scene, double x) {
    const Pose pose = sensor_at(x, 0.0);
    const LabelledScan scan = scene.scan(pose, 0.0);
    const ScanResult result = pipeline->add_scan(scan.view(), pose, stamp_ns += kPeriodNs);
    if (result.keyframe_ready) known.push_back(pipeline->keyframe().statistics->up_known);
    return result.error.code;
  };
  for (int i = 0; i < 20; ++i) REQUIRE(add(street, 0.3 * i) == ErrorCode::kOk);
  REQUIRE(known == std::vector<bool>{true, true});
  // The robot is carried to a field: the second pose there says that the first one was right.
  REQUIRE(add(field, 5000.0) == ErrorCode::kPoseJump);
  for (int i = 0; i < 10; ++i) REQUIRE(add(field, 5000.0 + 0.3 * i) == ErrorCode::kOk);
  CHECK(known == std::vector<bool>{true, true, false});
}

TEST_CASE("a broken promise of the odometry is counted, and reported once") {
  EventLog log;
  PipelineConfig config = small_config();
  config.odometry.up_sigma_deg = 0.5F;
  config.events = log.ring;
  const auto found = drive(street_of_houses(), config, tilted(5.0, 0.0));
  for (const Found& keyframe : found) {
    CHECK(keyframe.up.known);
    CHECK(keyframe.error_deg < 0.5);
    CHECK(keyframe.statistics.up_contradicted);
  }
  const std::vector<EventRecord> reports = log.take(EventId::kUpContradicted);
  REQUIRE(reports.size() == 1);
  CHECK(static_cast<double>(reports[0].values[0]) == Approx(5000.0).margin(500.0));
  CHECK(reports[0].values[1] == 500);
  CHECK(reports[0].values[2] == 0);

  config.events = nullptr;
  for (const Found& keyframe : drive(street_of_houses(), config, {})) {
    CHECK_FALSE(keyframe.statistics.up_contradicted);
  }
}
