// Prior on the relative tilt: covariances in one frame, its weight against a measurement.
#include "src/core/tilt_prior.hpp"

#include "tests/test.hpp"

using namespace unimapper;

namespace {

constexpr double kDegree = 1.0 / kDegreesPerRadian;

KeyframeUp known(double sigma_x_deg, double sigma_y_deg) {
  const auto variance = [](double deg) {
    return static_cast<float>(deg * deg * kDegree * kDegree);
  };
  return {true, variance(sigma_x_deg), 0.0F, variance(sigma_y_deg)};
}

Pose turned(double yaw_deg) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw_deg * kDegree, Eigen::Vector3d::UnitZ())),
          Eigen::Vector3d(3.0, -2.0, 1.0)};
}

Pose leaning(double deg, const Eigen::Vector3d& axis) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(deg * kDegree, axis)), Eigen::Vector3d::Zero()};
}

}  // namespace

TEST_CASE("the variances of both keyframes add up, in the axes of the match") {
  const KeyframeUp match = known(0.3, 0.3);
  const KeyframeUp query = known(0.4, 1.2);
  const auto sigma = [&](double yaw_deg, const Eigen::Vector2d& direction) {
    const TiltPrior prior(match, query, turned(yaw_deg));
    return kDegreesPerRadian / prior.sigmas(direction, 0.0);
  };
  const Eigen::Vector2d x = Eigen::Vector2d::UnitX();
  const Eigen::Vector2d y = Eigen::Vector2d::UnitY();
  CHECK(sigma(0.0, x) == Approx(0.5).epsilon(0.01));
  CHECK(sigma(0.0, y) == Approx(std::hypot(0.3, 1.2)).epsilon(0.01));
  CHECK(sigma(90.0, x) == Approx(std::hypot(0.3, 1.2)).epsilon(0.01));
  CHECK(sigma(90.0, y) == Approx(0.5).epsilon(0.01));
  CHECK(sigma(45.0, (x + y).normalized()) == Approx(0.5).epsilon(0.01));
}

TEST_CASE("a keyframe that does not know up counts with a sigma of 1.25 degrees") {
  const auto sigma_deg = [](const KeyframeUp& match, const KeyframeUp& query) {
    return 1.0 / TiltPrior(match, query, Pose{}).sigmas(Eigen::Vector2d(kDegree, 0.0), 0.0);
  };
  CHECK(sigma_deg({}, known(0.1, 0.1)) == Approx(1.25).epsilon(0.01));
  CHECK(sigma_deg(known(3.0, 3.0), {}) == Approx(3.25).epsilon(0.01));
  CHECK(sigma_deg({}, {}) == Approx(1.25 * std::sqrt(2.0)).epsilon(0.01));
  // Nor one whose covariance is none.
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const KeyframeUp& wrong :
       {KeyframeUp{true, nan, 0.0F, 1e-5F}, KeyframeUp{true, 0.0F, 0.0F, 0.0F},
        KeyframeUp{true, 1e-5F, 1e-3F, 1e-5F}}) {
    CHECK(sigma_deg(wrong, known(0.1, 0.1)) == Approx(1.25).epsilon(0.01));
  }
}

TEST_CASE("the uncertainty of the measured tilt adds to that of the prior") {
  const TiltPrior prior(known(0.3, 0.3), known(0.1, 0.4), Pose{});
  const Eigen::Vector2d tilt(0.0, 2.0 * kDegree);
  const double measured = 1.2 * kDegree;
  CHECK(prior.sigmas(tilt, measured) == Approx(2.0 / 1.3).epsilon(0.001));
  CHECK(prior.sigmas(tilt, Eigen::Matrix2d::Identity() / (measured * measured)) ==
        Approx(2.0 / 1.3).epsilon(0.001));
  // What was not measured contradicts nothing.
  CHECK(prior.sigmas(tilt, Eigen::Matrix2d::Zero()) == Approx(0.0).margin(1e-9));
}

TEST_CASE("prior and measured tilt are weighted by their information") {
  const TiltPrior prior(known(0.3, 0.3), known(0.4, 0.4), Pose{});
  const Eigen::Vector2d tilt(2.0 * kDegree, -kDegree);
  const auto information = [](double sigma_deg) -> Eigen::Matrix2d {
    return Eigen::Matrix2d::Identity() / std::pow(sigma_deg * kDegree, 2);
  };
  CHECK((prior.posterior(tilt, information(0.5)) - 0.5 * tilt).norm() < 1e-4);
  CHECK((prior.posterior(tilt, information(1.0)) - 0.2 * tilt).norm() < 1e-4);
  CHECK((prior.posterior(tilt, information(1e-4)) - tilt).norm() < 1e-6);
  CHECK(prior.posterior(tilt, Eigen::Matrix2d::Zero()).norm() < 1e-12);
}

TEST_CASE("a pose gets another tilt and keeps its heading") {
  const Pose pose = turned(137.0) * leaning(9.0, Eigen::Vector3d(0.6, 0.8, 0.0));
  CHECK(std::asin(tilt_of(pose).norm()) == Approx(9.0 * kDegree));
  const Pose level = with_tilt(pose, Eigen::Vector2d::Zero());
  CHECK(level.rotation.col(2) == Eigen::Vector3d::UnitZ());
  CHECK(level.is_rigid(1e-9));
  CHECK(level.translation == pose.translation);
  CHECK(rotation_angle(level.rotation.transpose() * turned(137.0).rotation) < 1e-6);
  const Pose again = with_tilt(level, tilt_of(pose));
  CHECK(rotation_angle(again.rotation.transpose() * pose.rotation) < 1e-6);
}

TEST_CASE("the tilt's derivative is that by a turn on the left") {
  const Pose pose = turned(-40.0) * leaning(12.0, Eigen::Vector3d(0.28, -0.96, 0.0));
  for (int axis = 0; axis < 3; ++axis) {
    const double step = 1e-6;
    Pose moved = pose;
    moved.rotation = Eigen::AngleAxisd(step, Eigen::Vector3d::Unit(axis)) * pose.rotation;
    const Eigen::Vector2d difference = (tilt_of(moved) - tilt_of(pose)) / step;
    CHECK((difference - tilt_derivative(pose).col(axis)).norm() < 1e-5);
  }
}
