// Tests of trajectory alignment and errors.
#include "unimapper/evaluate/trajectory.hpp"

#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::evaluate;

namespace {

Pose some_pose(double yaw, double roll, const Eigen::Vector3d& t) {
  return {Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
              Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()).toRotationMatrix(),
          t};
}

std::vector<PosePair> circle(const Pose& T_truth_estimate) {
  std::vector<PosePair> pairs;
  for (int i = 0; i < 40; ++i) {
    const double a = 0.1 * i;
    const Pose pose = some_pose(a, 0.02 * a, {20 * std::cos(a), 20 * std::sin(a), 0.1 * i});
    pairs.push_back({pose, T_truth_estimate * pose});
  }
  return pairs;
}

}  // namespace

TEST_CASE("alignment recovers the transform between two frames") {
  const Pose T = some_pose(2.5, 0.1, {100, -40, 3});
  const Alignment alignment = align(circle(T));
  CHECK_FALSE(alignment.used_orientations);
  CHECK((alignment.T_truth_estimate.rotation - T.rotation).norm() < 1e-9);
  CHECK((alignment.T_truth_estimate.translation - T.translation).norm() < 1e-8);
}

TEST_CASE("a planar path is never mirrored") {
  std::vector<PosePair> pairs;
  for (int i = 0; i < 20; ++i) {
    const Pose pose = some_pose(0.3 * i, 0, {5.0 * std::cos(0.3 * i), 5.0 * std::sin(0.3 * i), 0});
    pairs.push_back({pose, some_pose(1.0, 0, {1, 2, 0}) * pose});
  }
  CHECK(align(pairs).T_truth_estimate.rotation.determinant() == Approx(1.0));
  CHECK(trajectory_error(pairs, align(pairs).T_truth_estimate).rotation_deg.max < 1e-6);
}

TEST_CASE("orientations determine the rotation that a straight line leaves open") {
  const Pose T = some_pose(0.7, 0.3, {5, 6, 7});
  std::vector<PosePair> pairs;
  for (int i = 0; i < 30; ++i) {
    const Pose pose = some_pose(0, 0, {1.0 * i, 0.001 * (i % 3), 0});
    pairs.push_back({pose, T * pose});
  }
  const Alignment alignment = align(pairs);
  CHECK(alignment.used_orientations);
  CHECK_FALSE(align(circle(T)).used_orientations);
  CHECK(trajectory_error(pairs, alignment.T_truth_estimate).rotation_deg.max < 0.01);
}

TEST_CASE("a known offset is the trajectory error") {
  std::vector<PosePair> pairs = circle(Pose{});
  for (PosePair& pair : pairs) pair.estimate.translation.z() += 0.5;
  pairs.back().estimate.translation.z() += 1.0;
  pairs.back().estimate.rotation =
      pairs.back().estimate.rotation *
      Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY()).toRotationMatrix();
  const TrajectoryError error = trajectory_error(pairs, Pose{});
  CHECK(error.translation_m.count == 40);
  CHECK(error.translation_m.min == Approx(0.5));
  CHECK(error.translation_m.median == Approx(0.5));
  CHECK(error.translation_m.max == Approx(1.5));
  CHECK(error.translation_m.mean == Approx(0.525));
  CHECK(error.translation_m.rmse == Approx(std::sqrt((39 * 0.25 + 2.25) / 40)));
  CHECK(error.translation_m.std == Approx(std::sqrt((39 * 0.025 * 0.025 + 0.975 * 0.975) / 40)));
  CHECK(error.rotation_deg.max == Approx(5.7296).margin(1e-3));
  CHECK(error.rotation_deg.median == Approx(0.0).margin(1e-6));
}

TEST_CASE("the median of an even number of errors lies between the middle two") {
  CHECK(statistics({4, 1, 3, 2}).median == 2.5);
  CHECK(statistics({5}).median == 5.0);
  CHECK(statistics({}).count == 0);
}

TEST_CASE("poses are paired by the nearest stamp within the tolerance, of two the later") {
  constexpr std::int64_t kMost = kSameInstantNs;
  std::vector<StampedPose> truth;
  for (int i = 0; i < 5; ++i) truth.push_back({10 * i * kMost, some_pose(0, 0, {1.0 * i, 0, 0})});
  struct Expected {
    std::int64_t stamp_ns;
    double paired_x;  ///< -1: not paired
  };
  const Expected expected[] = {{-kMost - 1, -1}, {-kMost, 0},     {0, 0},
                               {kMost, 0},       {kMost + 1, -1}, {11 * kMost - 1, 1},
                               {39 * kMost, 4},  {90 * kMost, -1}};
  std::vector<StampedPose> estimate;
  for (const auto& [stamp_ns, x] : expected) {
    CAPTURE(stamp_ns);
    estimate.push_back({stamp_ns, {}});
    const auto pairs = associate(std::vector{estimate.back()}, truth);
    REQUIRE(pairs.size() == (x < 0.0 ? 0 : 1));
    if (!pairs.empty()) CHECK(pairs[0].truth.translation.x() == x);
  }
  CHECK(associate(estimate, truth).size() == 5);
  CHECK(associate(estimate, truth, 0).size() == 1);
  CHECK(associate(estimate, {}).empty());
  for (const std::int64_t off : {-1, 0, 1}) {
    const std::vector<StampedPose> halfway = {{5 * kMost + off, {}}};
    const auto pairs = associate(halfway, truth, 6 * kMost);
    REQUIRE(pairs.size() == 1);
    CHECK(pairs[0].truth.translation.x() == (off < 0 ? 0.0 : 1.0));
  }
}

TEST_CASE("aligning nothing is refused") { CHECK_THROWS_AS(align({}), std::invalid_argument); }

TEST_CASE("the tilt of a map is that of its z axis, whatever its heading and origin") {
  const double tilt_deg = 0.4;
  std::vector<PosePair> pairs = circle(Pose());
  const Pose T_map_world =
      some_pose(0, tilt_deg / kDegreesPerRadian, {100, -40, 3}) * some_pose(2.5, 0, {0, 0, 0});
  for (PosePair& pair : pairs) pair.estimate = T_map_world * pair.truth;
  const TrajectoryError error = trajectory_error(pairs, align(pairs).T_truth_estimate);
  CHECK(error.tilt_deg.min == Approx(tilt_deg));
  CHECK(error.tilt_deg.max == Approx(tilt_deg));
  CHECK(error.rotation_deg.max < 1e-6);
}
