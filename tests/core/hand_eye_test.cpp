// The pieces of hand-eye calibration that any processor computes alike
#include "src/core/hand_eye.hpp"

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "tests/test.hpp"

using namespace unimapper;

namespace {

Pose turned(double rad, double x_m) {
  return {Eigen::AngleAxisd(rad, Eigen::Vector3d::UnitZ()).toRotationMatrix(),
          Eigen::Vector3d(x_m, 0.0, 0.0)};
}

}  // namespace

TEST_CASE("the logarithm is that of the maths library") {
  for (const double x : {0.0, 1e-9, 0.01, 0.5, 0.7, 1.0, 2.0, 37.0, 1e6, 1e200}) {
    CHECK(std::abs(log_of_1_plus(x) - std::log1p(x)) <= 1e-12 * (1.0 + std::log1p(x)));
  }
}

TEST_CASE("a pose is moved on along the turn about it") {
  const Pose ahead = moved_on(turned(-0.1, 0.0), turned(0.0, 1.0), turned(0.1, 2.0), 0.2, 0.05);
  CHECK(std::abs(rotation_angle(ahead.rotation) - 0.05) < 1e-12);
  CHECK(std::abs(ahead.translation.x() - 1.5) < 1e-12);
}

TEST_CASE("of a steady turn the fourth difference shows nothing, of noise its size") {
  std::array<Pose, 5> poses;
  for (int k = 0; k < 5; ++k) poses[static_cast<std::size_t>(k)] = turned(0.05 * k, 0.0);
  CHECK(fourth_difference(poses).norm() < 1e-9);
  poses[2] = turned(0.1 + 0.01, 0.0);
  CHECK(std::abs(std::abs(fourth_difference(poses)[2]) - 0.06 / std::sqrt(70.0)) < 1e-6);
}
