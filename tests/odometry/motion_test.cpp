// Tests of motion at constant velocity.
#include "src/odometry/motion.hpp"

#include <catch2/catch.hpp>

#include "src/odometry/sweep.hpp"
#include "tests/random.hpp"

using namespace unimapper;
using namespace unimapper::odometry;

namespace {

Eigen::Vector3d random_vector(test::Random& random, double most) {
  return {random.uniform(-most, most), random.uniform(-most, most), random.uniform(-most, most)};
}

struct TimedPoint {
  float time_s;
};

}  // namespace

TEST_CASE("rotations agree with the trigonometric functions") {
  test::Random random(1);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d angle_rad = random_vector(random, i % 2 == 0 ? 3.0 : 1e-3);
    const Eigen::Matrix3d expected =
        Eigen::AngleAxisd(angle_rad.norm(), angle_rad.normalized()).toRotationMatrix();
    CHECK((rotation_of(angle_rad) - expected).norm() < 1e-12);
  }
  CHECK(rotation_of(Eigen::Vector3d::Zero()).isIdentity(0.0));
}

TEST_CASE("a rotation vector is that of its rotation, up to half a turn") {
  test::Random random(2);
  for (int i = 0; i < 200; ++i) {
    const double length = i % 3 == 0 ? 3.1415 : random.uniform(0.0, 3.1);
    const Eigen::Vector3d angle_rad = length * random_vector(random, 1.0).normalized();
    CHECK((rotation_vector(rotation_of(angle_rad)) - angle_rad).norm() < 1e-9);
  }
  CHECK(rotation_vector(Eigen::Matrix3d::Identity()).norm() == 0.0);
}

TEST_CASE("the velocity between two poses leads from one to the other") {
  test::Random random(3);
  for (int i = 0; i < 50; ++i) {
    const Velocity velocity{random_vector(random, 10.0), random_vector(random, 2.0)};
    const double seconds = random.uniform(0.01, 0.6);
    const Velocity found = velocity_of(moved(velocity, seconds), seconds);
    CHECK((found.linear_m_s - velocity.linear_m_s).norm() < 1e-9);
    CHECK((found.angular_rad_s - velocity.angular_rad_s).norm() < 1e-9);
  }
}

TEST_CASE("a sweep places points where the sensor was at their time") {
  const Velocity velocity{{8.0, 0.5, -0.2}, {0.1, -0.2, 0.9}};
  const Pose now(Eigen::Quaterniond(0.9, 0.1, -0.2, 0.3), {4.0, 5.0, 6.0});
  const Pose before = now * moved(velocity, -0.1);
  const std::vector<TimedPoint> times = {{-0.07F}, {-0.02F}, {0.03F}};
  constexpr double kMiddle_s = -0.02;
  const Sweep sweep = Sweep::of(times, before, now, 0.1, kMiddle_s);
  const Eigen::Vector3d point(20.0, -10.0, 2.0);
  for (const TimedPoint& at : times) {
    const Pose then = now * moved(velocity, static_cast<double>(at.time_s) - kMiddle_s);
    const Sweep::Place place = sweep.place(point, at.time_s);
    CHECK((place.place_m - then * point).norm() < 1e-4);
    CHECK((place.arm_m - then.rotation * point).norm() < 1e-4);
  }
}
