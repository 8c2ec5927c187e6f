// Tests of the rigid fit of matched points.
#include "src/core/rigid_fit.hpp"

#include "tests/random.hpp"
#include "tests/test.hpp"

namespace {

using namespace unimapper;
using test::Random;

Pose some_pose() {
  const Eigen::Quaterniond q(0.3, -0.5, 0.2, 0.78);
  return {q, {12.0, -7.0, 1.5}};
}

std::vector<PointPair> pairs_of(const Pose& T_b_a, const Eigen::Vector3d& spread, int count,
                                double noise = 0.0) {
  Random random(3);
  std::vector<PointPair> pairs;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d p{random.uniform(-1, 1) * spread.x(), random.uniform(-1, 1) * spread.y(),
                            random.uniform(-1, 1) * spread.z()};
    const Eigen::Vector3d n{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    pairs.push_back({p, T_b_a * p + noise * n});
  }
  return pairs;
}

double distance(const Pose& a, const Pose& b) {
  return (a.translation - b.translation).norm() + (a.rotation - b.rotation).norm();
}

}  // namespace

TEST_CASE("exact pairs give the exact pose, in space and in a plane, and three are enough") {
  for (const Eigen::Vector3d& spread :
       {Eigen::Vector3d(20, 20, 20), Eigen::Vector3d(20, 20, 0), Eigen::Vector3d(20, 0.5, 0)}) {
    Pose fitted;
    REQUIRE(fit_rigid(pairs_of(some_pose(), spread, 12), fitted));
    REQUIRE(distance(fitted, some_pose()) < 1e-8);
    REQUIRE(fitted.is_rigid(1e-9));
  }
  Pose fitted;
  REQUIRE(fit_rigid(pairs_of(some_pose(), {20, 20, 20}, 3), fitted));
  REQUIRE(distance(fitted, some_pose()) < 1e-8);
}

TEST_CASE("a proper rotation is fitted where a reflection would fit best") {
  // Points in a plane, pushed through it by noise: without the correction, the determinant of
  // the optimum is -1.
  std::vector<PointPair> pairs = pairs_of(Pose{}, {10, 10, 0.05}, 8);
  for (PointPair& pair : pairs) pair.b.z() = -pair.b.z();
  Pose fitted;
  REQUIRE(fit_rigid(pairs, fitted));
  REQUIRE(fitted.rotation.determinant() == Approx(1.0).margin(1e-9));
  REQUIRE(fitted.is_rigid(1e-9));
  REQUIRE(distance(fitted, Pose{}) < 0.05);

  // A full mirror image has no good pose, but still gets a rotation.
  pairs = pairs_of(Pose{}, {10, 10, 10}, 8);
  for (PointPair& pair : pairs) pair.b.x() = -pair.b.x();
  REQUIRE(fit_rigid(pairs, fitted));
  REQUIRE(fitted.rotation.determinant() == Approx(1.0).margin(1e-9));
}

TEST_CASE("noise averages out over many pairs") {
  Pose fitted;
  REQUIRE(fit_rigid(pairs_of(some_pose(), {30, 30, 2}, 400, 0.2), fitted));
  REQUIRE((fitted.translation - some_pose().translation).norm() < 0.03);
}

TEST_CASE("too few pairs, one line and one spot determine nothing") {
  Pose fitted;
  REQUIRE_FALSE(fit_rigid({}, fitted));
  REQUIRE_FALSE(fit_rigid(pairs_of(some_pose(), {9, 9, 9}, 2), fitted));
  REQUIRE_FALSE(fit_rigid(pairs_of(some_pose(), {9, 0, 0}, 10), fitted));
  REQUIRE_FALSE(fit_rigid(pairs_of(some_pose(), {0, 0, 0}, 10), fitted));
}

TEST_CASE("a level pose follows from level pairs") {
  Random random(4);
  const double yaw = 2.4;
  Eigen::Vector2f a[20];
  Eigen::Vector2f b[20];
  for (int i = 0; i < 20; ++i) {
    a[i] = {static_cast<float>(random.uniform(-30, 30)),
            static_cast<float>(random.uniform(-30, 30))};
    const auto c = static_cast<float>(std::cos(yaw));
    const auto s = static_cast<float>(std::sin(yaw));
    b[i] = {c * a[i].x() - s * a[i].y() + 4.0F, s * a[i].x() + c * a[i].y() - 9.0F};
  }
  PlanarPose pose;
  REQUIRE(fit_planar(a, b, 20, pose));
  REQUIRE(pose.cosine == Approx(std::cos(yaw)).margin(1e-5));
  REQUIRE(pose.sine == Approx(std::sin(yaw)).margin(1e-5));
  REQUIRE((pose * a[3] - b[3]).norm() < 1e-3F);
  REQUIRE_FALSE(fit_planar(a, b, 0, pose));
  REQUIRE_FALSE(fit_planar(a, b, 1, pose));
}
