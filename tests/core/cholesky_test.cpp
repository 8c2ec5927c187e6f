// Tests of the Cholesky solver.
#include "src/core/cholesky.hpp"

#include <Eigen/LU>
#include <cmath>

#include "tests/test.hpp"

using unimapper::Cholesky;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

namespace {

Matrix6d positive_definite() {
  Matrix6d a;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) a(i, j) = 1.0 / (1 + i + 2 * j) + (i == j ? 1.0 : 0.0);
  }
  return a * a.transpose();
}

}  // namespace

TEST_CASE("a positive definite system is solved", "[cholesky]") {
  const Matrix6d m = positive_definite();
  const Vector6d x = Vector6d::LinSpaced(-2.0, 3.0);
  const Cholesky<6> factor(m);
  REQUIRE(factor.valid());
  CHECK((factor.solve(m * x) - x).norm() < 1e-12);
}

TEST_CASE("the inverse is an inverse and exactly symmetric", "[cholesky]") {
  const Matrix6d m = positive_definite();
  const Matrix6d inverse = Cholesky<6>(m).inverse();
  CHECK((m * inverse - Matrix6d::Identity()).norm() < 1e-12);
  CHECK(inverse == inverse.transpose());
}

TEST_CASE("whitened columns have the lengths that the inverse gives them", "[cholesky]") {
  const Matrix6d m = positive_definite();
  const Cholesky<6> factor(m);
  const Vector6d x = Vector6d::LinSpaced(-2.0, 3.0);
  Vector6d white = x;
  factor.whiten(white);
  CHECK(std::abs(white.squaredNorm() - x.dot(factor.solve(x))) < 1e-9);
  double root = 1.0;
  for (int i = 0; i < 6; ++i) root *= factor.diagonal(i);
  CHECK(std::abs(root * root - m.determinant()) < 1e-9);
}

TEST_CASE("a matrix that is not positive definite is invalid and solves to zero", "[cholesky]") {
  Matrix6d indefinite = Matrix6d::Identity();
  indefinite(3, 3) = -1.0;
  Matrix6d broken = Matrix6d::Identity();
  broken(5, 2) = std::numeric_limits<double>::quiet_NaN();
  for (const Matrix6d& m : {indefinite, broken, Matrix6d(Matrix6d::Zero())}) {
    const Cholesky<6> factor(m);
    CHECK_FALSE(factor.valid());
    CHECK(factor.solve(Vector6d::Ones()).isZero(0.0));
    CHECK(factor.inverse().isZero(0.0));
  }
}
