// Tests of the messages of a simulated robot's drivers.
#include "run_folder.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::simulator;
using namespace unimapper::simulator::test;

namespace {

SimulationConfig small_config() { return short_drive(SensorKind::kVlp16, 5, 42); }

std::vector<DriveStep> drive(const SimulationConfig& config, const std::filesystem::path& folder) {
  std::vector<DriveStep> steps;
  simulate(config, folder, {}, [&](const DriveStep& step) { steps.push_back(step); });
  return steps;
}

double distance(const Frame& a, const Frame& b) {
  return norm(a.origin - b.origin) + norm(a.x - b.x) + norm(a.y - b.y);
}

}  // namespace

TEST_CASE("the steps of a drive come in order, whatever the number of threads") {
  TemporaryDirectory folder;
  SimulationConfig config = small_config();
  config.threads = GENERATE(1U, 4U);
  const std::vector<DriveStep> steps = drive(config, folder.path());
  REQUIRE(steps.size() == 5);
  std::int64_t last_ns = 0;
  for (std::uint32_t i = 0; i < 5; ++i) {
    CHECK(steps[i].scan == i);
    CHECK(steps[i].stamp_ns == 100'000'000 * (i + 1));
    CHECK(steps[i].odometry.size() == (i == 0 ? 11 : 10));
    CHECK(steps[i].odometry.back().stamp_ns == steps[i].stamp_ns);
    for (const OdometrySample& sample : steps[i].odometry) {
      CHECK(sample.stamp_ns > last_ns);
      last_ns = sample.stamp_ns;
    }
  }
}

TEST_CASE("the points of a drive are those of an uncompensated recording") {
  TemporaryDirectory folder;
  SimulationConfig config = small_config();
  config.is_distorted = true;
  config.mount.pitch_deg = 10.0;
  config.points = GENERATE(PointFrame::kSensor, PointFrame::kBody);
  const std::vector<DriveStep> steps = drive(config, folder.path());
  for (const DriveStep& step : steps) {
    const std::vector<LabelledPoint> scan = read_scan(folder.path(), step.scan);
    REQUIRE(scan.size() == step.points.size());
    REQUIRE(scan.size() > 100);
    for (std::size_t i = 0; i < scan.size(); ++i) {
      const RawPoint& point = step.points[i];
      REQUIRE(point.x == scan[i].x);
      REQUIRE(point.y == scan[i].y);
      REQUIRE(point.z == scan[i].z);
      REQUIRE(point.intensity == scan[i].intensity);
      REQUIRE(point.time_s >= -0.1F);
      REQUIRE(point.time_s <= 0.0F);
      REQUIRE(point.ring < 16);
    }
  }
}

TEST_CASE("what a drive's observer sees does not change the recording") {
  TemporaryDirectory observed;
  drive(small_config(), observed.path());
  const Recording unobserved(small_config());
  for (const char* file : {"scans/000004.bin", "poses.txt"}) {
    CHECK((read_bytes(observed / file) == unobserved.bytes_of(file)));
  }
}

TEST_CASE(
    "the odometry of a drive is that of the recording at its stamps, and smooth between them") {
  TemporaryDirectory folder;
  SimulationConfig config = small_config();
  config.scans = 20;
  config.thin = 64;
  config.drift = DriftPreset::kBad;
  const std::vector<DriveStep> steps = drive(config, folder.path());
  const std::vector<Frame> poses = read_poses(folder.path() / "poses.txt");
  const std::vector<Frame> truth = read_poses(folder.path() / "gt_poses.txt");
  REQUIRE(poses.size() == steps.size());
  const OdometrySample* before = nullptr;
  for (const DriveStep& step : steps) {
    CHECK(distance(step.odometry.back().T_odometry_points, poses[step.scan]) < 1e-5);
    CHECK(distance(step.odometry.back().T_world_points, truth[step.scan]) < 1e-5);
    for (const OdometrySample& sample : step.odometry) {
      if (before != nullptr) {
        // 10 ms at no more than 10 m/s, and a tenth of the error of one scan.
        const Frame moved = before->T_odometry_points.inverse() * sample.T_odometry_points;
        const Frame moved_truly = before->T_world_points.inverse() * sample.T_world_points;
        CHECK(norm(moved.origin) < 0.12);
        CHECK(distance(moved, moved_truly) < 0.012);
      }
      before = &sample;
    }
  }
}

TEST_CASE("rings are numbered as the sensors' drivers do") {
  std::vector<PatternRay> rays;
  make_pattern(SensorKind::kVlp16, 0.0, 64, rays);
  for (std::size_t i = 0; i < 16; ++i) {
    const double elevation = std::asin(rays[i].direction.z) / kDegree;
    CHECK(elevation == Approx(-15.0 + 2.0 * rays[i].ring).margin(1e-9));
  }
  make_pattern(SensorKind::kOs1_64, 0.0, 64, rays);
  for (std::size_t i = 0; i < 64; ++i) {
    CHECK(rays[i].ring == i);
    const double elevation = std::asin(rays[i].direction.z) / kDegree;
    CHECK(elevation == Approx(22.5 - 45.0 * rays[i].ring / 63.0).margin(1e-9));
  }
}
