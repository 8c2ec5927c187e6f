// Tests of the symmetric 3x3 eigen solver, including degenerate voxels.
#include "src/core/symmetric_eigen.hpp"

#include "tests/random.hpp"
#include "tests/test.hpp"

namespace {

using unimapper::symmetric_eigen;
using unimapper::SymmetricEigen;

template <typename Scalar>
void require_decomposes(const Eigen::Matrix<Scalar, 3, 3>& m, Scalar tolerance) {
  const SymmetricEigen<Scalar> eigen = symmetric_eigen(m);
  const Scalar scale = m.cwiseAbs().maxCoeff();
  const Eigen::Matrix<Scalar, 3, 3> again =
      eigen.vectors * eigen.values.asDiagonal() * eigen.vectors.transpose();
  INFO("matrix\n" << m << "\nrebuilt\n" << again);
  REQUIRE((again - m).cwiseAbs().maxCoeff() <= tolerance * scale);
  REQUIRE((eigen.vectors.transpose() * eigen.vectors - Eigen::Matrix<Scalar, 3, 3>::Identity())
              .cwiseAbs()
              .maxCoeff() <= tolerance);
  REQUIRE(eigen.values(0) <= eigen.values(1));
  REQUIRE(eigen.values(1) <= eigen.values(2));
}

}  // namespace

TEST_CASE("random symmetric matrices are decomposed to rounding error") {
  unimapper::test::Random random(1);
  for (int i = 0; i < 500; ++i) {
    Eigen::Matrix3d a;
    for (int k = 0; k < 9; ++k) a(k) = random.uniform(-1.0, 1.0);
    const Eigen::Matrix3d m = a + a.transpose();
    require_decomposes<double>(m, 1e-14);
    require_decomposes<float>(m.cast<float>(), 4e-6F);
  }
}

TEST_CASE("degenerate matrices are decomposed like any other") {
  require_decomposes<double>(Eigen::Matrix3d::Identity(), 1e-15);
  require_decomposes<double>(Eigen::Vector3d(1, 0, 0).asDiagonal().toDenseMatrix(), 1e-15);
  require_decomposes<double>(Eigen::Vector3d(2, 2, 1e-12).asDiagonal().toDenseMatrix(), 1e-15);
  // A line, a plane and a nearly isotropic ball in a direction that favours no axis.
  const Eigen::Vector3d d = Eigen::Vector3d(1, 2, 3).normalized();
  require_decomposes<double>(d * d.transpose(), 1e-15);
  require_decomposes<double>(Eigen::Matrix3d::Identity() - d * d.transpose(), 1e-14);
  require_decomposes<double>(Eigen::Matrix3d::Identity() + 1e-13 * d * d.transpose(), 1e-14);
}

TEST_CASE("the normal of a thin plane is found whatever its scale") {
  const Eigen::Vector3d normal = Eigen::Vector3d(0.3, -0.5, 0.8).normalized();
  const Eigen::Matrix3d plane =
      Eigen::Matrix3d::Identity() - (1.0 - 1e-4) * normal * normal.transpose();
  for (const double scale : {1e-200, 1e-6, 1.0, 1e6, 1e200}) {
    const auto eigen = symmetric_eigen<double>(plane * scale);
    REQUIRE(std::abs(eigen.vectors.col(0).dot(normal)) == Approx(1.0).margin(1e-12));
    REQUIRE(eigen.values(0) / scale == Approx(1e-4).epsilon(1e-9));
  }
}

TEST_CASE("zero and non-finite matrices give zero values and the identity") {
  Eigen::Matrix3d bad = Eigen::Matrix3d::Identity();
  for (const double value :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    bad(0, 1) = bad(1, 0) = value;
    const auto eigen = symmetric_eigen<double>(bad);
    REQUIRE(eigen.values.isZero(0.0));
    REQUIRE(eigen.vectors == Eigen::Matrix3d::Identity());
  }
  const auto zero = symmetric_eigen<float>(Eigen::Matrix3f::Zero());
  REQUIRE(zero.values.isZero(0.0F));
  REQUIRE(zero.vectors == Eigen::Matrix3f::Identity());
}
