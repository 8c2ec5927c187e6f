// Tests of the nearest rotation (orthogonal Procrustes).
#include "src/core/nearest_rotation.hpp"

#include "tests/test.hpp"

using unimapper::nearest_rotation;

namespace {

const Eigen::Matrix3d kTurn =
    Eigen::AngleAxisd(0.7, Eigen::Vector3d(1.0, -2.0, 0.5).normalized()).toRotationMatrix();

}  // namespace

TEST_CASE("a stretched rotation gives the rotation back", "[nearest_rotation]") {
  const Eigen::Matrix3d stretched = kTurn * Eigen::Vector3d(4.0, 2.0, 1.0).asDiagonal();
  const auto fit = nearest_rotation(stretched);
  CHECK((fit.rotation - kTurn).norm() < 1e-12);
  CHECK(std::abs(fit.deciding_value - 2.0) < 1e-12);
}

TEST_CASE("points in one plane and mirrored points give a proper rotation", "[nearest_rotation]") {
  for (const double third : {0.0, -0.1}) {
    const Eigen::Matrix3d m = kTurn * Eigen::Vector3d(4.0, 2.0, third).asDiagonal();
    const auto fit = nearest_rotation(m);
    CHECK(std::abs(fit.rotation.determinant() - 1.0) < 1e-12);
    CHECK((fit.rotation - kTurn).norm() < 1e-7);
  }
}

TEST_CASE("points almost on one line give a rotation that is orthogonal to the last digits",
          "[nearest_rotation]") {
  // The second direction is six orders weaker: rounding mixes the first one into its image.
  const Eigen::Matrix3d m = kTurn * Eigen::Vector3d(1.0, 1.7e-6, 0.0).asDiagonal() *
                            Eigen::AngleAxisd(1.1, Eigen::Vector3d(0.3, 0.9, -0.2).normalized())
                                .toRotationMatrix()
                                .transpose();
  const auto fit = nearest_rotation(m);
  CHECK((fit.rotation.transpose() * fit.rotation - Eigen::Matrix3d::Identity()).norm() < 1e-14);
}

TEST_CASE("points on one line say nothing about a rotation", "[nearest_rotation]") {
  const Eigen::Vector3d line(1.0, 2.0, 3.0);
  for (const Eigen::Matrix3d& m :
       {Eigen::Matrix3d(line * line.transpose()), Eigen::Matrix3d(Eigen::Matrix3d::Zero())}) {
    const auto fit = nearest_rotation(m);
    CHECK(fit.deciding_value == 0.0);
    CHECK(fit.rotation.isIdentity(0.0));
  }
}
