// Tests of the odometry drift presets.
#include "src/simulator/odometry.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::simulator;

namespace {

/// A kilometre of gentle curves and hills, a pose every 0.7 m.
std::vector<Frame> curvy_drive() {
  std::vector<Frame> poses;
  Vec3 at{120.0, -40.0, 3.0};
  double yaw = 0.8;
  for (int i = 0; i < 1500; ++i) {
    yaw += 0.012 * std::sin(0.02 * i);
    const double pitch = 0.04 * std::sin(0.013 * i);
    Frame& pose = poses.emplace_back(rotation_frame({0, 0, yaw}) * rotation_frame({0, -pitch, 0}));
    pose.origin = at = at + 0.7 * pose.x;
  }
  return poses;
}

struct Drift {
  double percent, degrees_per_100_m;
};

/// Mean error of the relative motion over stretches of about 100 m, averaged over many seeds.
Drift measured_drift(DriftPreset preset) {
  constexpr std::size_t kStretch = 143;
  const std::vector<Frame> truth = curvy_drive();
  Drift sum{};
  int count = 0;
  for (std::uint64_t key = 0; key < 12; ++key) {
    const std::vector<Frame> estimate = drifting_odometry(truth, preset, key);
    REQUIRE(estimate.size() == truth.size());
    for (std::size_t i = 0; i + kStretch < truth.size(); i += kStretch) {
      const Frame actual = truth[i].inverse() * truth[i + kStretch];
      const Frame estimated = estimate[i].inverse() * estimate[i + kStretch];
      const Frame error = actual.inverse() * estimated;
      sum.percent += norm(error.origin);  // of 100 m
      sum.degrees_per_100_m += norm(rotation_vector(error)) / kDegree;
      ++count;
    }
  }
  return {sum.percent / count, sum.degrees_per_100_m / count};
}

}  // namespace

TEST_CASE("odometry without drift is the truth in the odometry frame") {
  const std::vector<Frame> truth = curvy_drive();
  const std::vector<Frame> poses = drifting_odometry(truth, DriftPreset::kNone, 1);
  REQUIRE(poses.size() == truth.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Frame estimated = poses[0].inverse() * poses[i];
    CHECK_FALSE(norm((truth[0].inverse() * truth[i]).origin - estimated.origin) > 1e-6);
  }
}

TEST_CASE("the odometry frame starts at the sensor, without its yaw, with gravity down") {
  const std::vector<Frame> truth = curvy_drive();
  for (const DriftPreset preset : {DriftPreset::kNone, DriftPreset::kLio, DriftPreset::kBad}) {
    const Frame first = drifting_odometry(truth, preset, 3).front();
    CHECK(norm(first.origin) == Approx(0.0).margin(1e-9));
    CHECK(std::atan2(first.x.y, first.x.x) == Approx(0.0).margin(1e-9));
    CHECK(first.x.z == Approx(truth.front().x.z));  // pitch stays
    CHECK(first.z.z == Approx(truth.front().z.z));
  }
}

TEST_CASE("presets drift within their bands") {
  struct Band {
    DriftPreset preset;
    Drift least, most;
  };
  const Band bands[] = {{DriftPreset::kLio, {0.12, 0.03}, {0.4, 0.2}},
                        {DriftPreset::kIcp, {0.35, 0.12}, {0.9, 0.45}},
                        {DriftPreset::kBad, {1.0, 0.5}, {3.0, 2.0}}};
  for (const auto& [preset, least, most] : bands) {
    const Drift drift = measured_drift(preset);
    CHECK(drift.percent > least.percent);
    CHECK(drift.percent < most.percent);
    CHECK(drift.degrees_per_100_m > least.degrees_per_100_m);
    CHECK(drift.degrees_per_100_m < most.degrees_per_100_m);
  }
}

TEST_CASE("lio drift keeps gravity, and keys are independent") {
  const std::vector<Frame> truth = curvy_drive();
  const std::vector<Frame> one = drifting_odometry(truth, DriftPreset::kLio, 1);
  const std::vector<Frame> other = drifting_odometry(truth, DriftPreset::kLio, 2);
  CHECK(norm(one.back().origin - other.back().origin) > 0.05);
  for (std::size_t i = 0; i < truth.size(); i += 50) {
    const Vec3 up{one[i].x.z, one[i].y.z, one[i].z.z};
    const Vec3 true_up{truth[i].x.z, truth[i].y.z, truth[i].z.z};
    CHECK_FALSE(norm(cross(up, true_up)) > 0.3 * kDegree);
  }
}
