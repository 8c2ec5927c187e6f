// Tests of mounts, odometry starts, attitude noise, sway and motion distortion.
#include "run_folder.hpp"
#include "src/simulator/attitude.hpp"
#include "src/simulator/surface.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::simulator;
using namespace unimapper::simulator::test;

namespace {

SimulationConfig undrifted() {
  SimulationConfig config = short_drive(SensorKind::kOs1_64, 12, 6);
  config.drift = DriftPreset::kNone;
  return config;
}

double tilt_deg(const Frame& pose) { return std::acos(std::min(1.0, pose.z.z)) / kDegree; }

double angle_deg(const Frame& a, const Frame& b) {
  return norm(rotation_vector(orthonormalized(a.inverse() * b))) / kDegree;
}

/// Mean height of the points that are labelled as road or sidewalk, in the frame of `pose`.
double ground_height(const std::vector<LabelledPoint>& scan, const Frame& pose) {
  double sum = 0.0;
  double count = 0.0;
  for (const LabelledPoint& p : scan) {
    if (p.label != label::kRoad || norm(position(p)) > 10.0) continue;
    sum += pose(position(p)).z;
    count += 1.0;
  }
  REQUIRE(count > 20.0);
  return sum / count;
}

}  // namespace

TEST_CASE("a tilted mount tilts the true poses and leaves the world where it is") {
  SimulationConfig config = undrifted();
  const Recording level(config);
  config.mount = {4.0, 10.0};
  const Recording tilted(config);
  const Frame mount = mount_frame(config.mount);
  CHECK(mount.x.z < 0.0);  // positive pitch looks down
  for (std::size_t i = 0; i < level.truth.size(); ++i) {
    CHECK(angle_deg(level.truth[i] * mount, tilted.truth[i]) == Approx(0.0).margin(1e-3));
    CHECK_FALSE(norm(level.truth[i].origin - tilted.truth[i].origin) > 1e-5);
  }
  CHECK(ground_height(tilted.scans.back(), tilted.truth.back()) ==
        Approx(ground_height(level.scans.back(), level.truth.back())).margin(0.1));
}

TEST_CASE("odometry starts level or at identity, and both tell the same motion") {
  SimulationConfig config = undrifted();
  config.mount = {3.0, 8.0};
  config.drift = GENERATE(DriftPreset::kNone, DriftPreset::kLio);
  const Recording level(config);
  config.odometry_start = OdometryStart::kIdentity;
  const Recording identity(config);
  CHECK(tilt_deg(level.odometry.front()) > 7.0);
  CHECK(std::abs(level.odometry.front().x.y) < 1e-6);
  CHECK(angle_deg({}, identity.odometry.front()) == Approx(0.0).margin(1e-6));
  for (std::size_t i = 0; i < level.odometry.size(); ++i) {
    const Frame a = level.odometry.front().inverse() * level.odometry[i];
    CHECK(angle_deg(a, identity.odometry[i]) == Approx(0.0).margin(1e-3));
    CHECK_FALSE(norm(a.origin - identity.odometry[i].origin) > 1e-4);
  }
}

TEST_CASE("points in the body's frame are those of the sensor, rotated by the mount") {
  SimulationConfig config = undrifted();
  config.mount = {0.0, 15.0};
  const Recording sensor(config);
  config.points = PointFrame::kBody;
  const Recording body(config);
  REQUIRE(sensor.scans.back().size() == body.scans.back().size());
  const Frame mount = mount_frame(config.mount);
  for (std::size_t i = 0; i < sensor.scans.back().size(); i += 50) {
    const Vec3 s = position(sensor.scans.back()[i]);
    const Vec3 b = position(body.scans.back()[i]);
    CHECK_FALSE(norm(mount(s) - b) > 1e-4);
    CHECK_FALSE(norm(sensor.truth.back()(s) - body.truth.back()(b)) > 1e-3);
  }
  CHECK(tilt_deg(body.odometry.front()) < 6.0);  // the road
  CHECK(tilt_deg(sensor.odometry.front()) > 9.0);
}

TEST_CASE("attitude noise has its standard deviation and its correlation, and no yaw") {
  const double correlated_s = GENERATE(0.0, 2.0);
  std::vector<Frame> poses(20000);
  add_attitude_noise({0.5, correlated_s}, 0.1, {}, 3, poses);
  CHECK(angle_deg({}, poses.front()) == Approx(0.0).margin(1e-9));
  double squares = 0.0;
  double products = 0.0;
  for (std::size_t i = 2; i < poses.size(); ++i) {
    const Vec3 now = rotation_vector(poses[i]);
    const Vec3 before = rotation_vector(poses[i - 1]);
    squares += now.x * now.x + now.y * now.y;
    products += now.x * before.x + now.y * before.y;
    CHECK_FALSE(std::abs(now.z) > 1e-9);
  }
  const double sigma = std::sqrt(squares / (2.0 * static_cast<double>(poses.size()))) / kDegree;
  CHECK(sigma == Approx(0.5).epsilon(0.1));
  CHECK(products / squares == Approx(correlated_s > 0.0 ? std::exp(-0.05) : 0.0).margin(0.03));
}

TEST_CASE("noise of the odometry leaves truth and points alone") {
  SimulationConfig config = undrifted();
  const Recording exact(config);
  config.attitude_noise = {0.5, 0.0};
  const Recording noisy(config);
  for (const char* file : {"gt_poses.txt", "scans/000003.bin", "labels/000003.label"}) {
    INFO(file);
    CHECK((exact.bytes_of(file) == noisy.bytes_of(file)));
  }
  CHECK(angle_deg(exact.odometry[5], noisy.odometry[5]) > 0.05);
  CHECK(angle_deg(exact.odometry[5], noisy.odometry[5]) < 3.0);
}

TEST_CASE("a swaying body tilts the truth and the odometry alike") {
  SimulationConfig config = undrifted();
  config.sway = {5.0, 2.0};
  const Recording run(config);
  double most = 0.0;
  for (std::size_t i = 0; i < run.truth.size(); ++i) {
    most = std::max(most, tilt_deg(run.truth[i]));
    const Frame truth = run.truth.front().inverse() * run.truth[i];
    const Frame told = run.odometry.front().inverse() * run.odometry[i];
    CHECK(angle_deg(truth, told) == Approx(0.0).margin(1e-3));
  }
  CHECK(most > 2.5);
  CHECK(most < 11.0);
}

TEST_CASE("distorted points lie where the sensor was at the time of the shot") {
  SimulationConfig config = undrifted();
  const Recording compensated(config);
  config.is_distorted = true;
  const Recording distorted(config);
  REQUIRE(compensated.scans.back().size() == distorted.scans.back().size());
  const double step =
      norm(distorted.truth[11].origin - distorted.truth[10].origin);  // metres in one sweep
  REQUIRE(step > 0.3);
  double first = 0.0;
  double last = 0.0;
  const std::size_t count = distorted.scans.back().size();
  const auto shift = [&](std::size_t i) {
    return norm(position(compensated.scans.back()[i]) - position(distorted.scans.back()[i]));
  };
  for (std::size_t i = 0; i < 20; ++i) {
    first += shift(i) / 20.0;
    last += shift(count - 1 - i) / 20.0;
  }
  CHECK(first == Approx(step).epsilon(0.3));
  CHECK(last < 0.15 * step);
}
