#include "symmetric_eigen.hpp"

#include <cmath>
#include <limits>
#include <utility>

namespace unimapper {
namespace {

// One Jacobi rotation that zeroes element (p, q) of the symmetric `m` and is applied to
// `vectors`; r is the third axis.
template <typename Scalar>
void jacobi_rotate(Eigen::Matrix<Scalar, 3, 3>& m, Eigen::Matrix<Scalar, 3, 3>& vectors, int p,
                   int q, int r) noexcept {
  const Scalar off = m(p, q);
  if (off == Scalar(0)) return;
  // theta may overflow to infinity when `off` is tiny: the rotation then is the identity.
  const Scalar theta = (m(q, q) - m(p, p)) / (Scalar(2) * off);
  const Scalar magnitude = Scalar(1) / (std::abs(theta) + std::sqrt(theta * theta + Scalar(1)));
  const Scalar tangent = theta < Scalar(0) ? -magnitude : magnitude;
  const Scalar cosine = Scalar(1) / std::sqrt(tangent * tangent + Scalar(1));
  const Scalar sine = tangent * cosine;
  m(p, p) -= tangent * off;
  m(q, q) += tangent * off;
  m(p, q) = m(q, p) = Scalar(0);
  const Scalar rp = m(r, p);
  const Scalar rq = m(r, q);
  m(r, p) = m(p, r) = cosine * rp - sine * rq;
  m(r, q) = m(q, r) = sine * rp + cosine * rq;
  for (int row = 0; row < 3; ++row) {
    const Scalar vp = vectors(row, p);
    const Scalar vq = vectors(row, q);
    vectors(row, p) = cosine * vp - sine * vq;
    vectors(row, q) = sine * vp + cosine * vq;
  }
}

}  // namespace

template <typename Scalar>
SymmetricEigen<Scalar> symmetric_eigen(const Eigen::Matrix<Scalar, 3, 3>& matrix) noexcept {
  SymmetricEigen<Scalar> result;
  Eigen::Matrix<Scalar, 3, 3> m;
  m << matrix(0, 0), matrix(0, 1), matrix(0, 2),  //
      matrix(0, 1), matrix(1, 1), matrix(1, 2),   //
      matrix(0, 2), matrix(1, 2), matrix(2, 2);
  // Working near one keeps squares from overflowing or vanishing.
  const Scalar scale = m.cwiseAbs().maxCoeff();
  if (!(scale >= std::numeric_limits<Scalar>::min()) || !m.allFinite()) return result;
  m /= scale;

  constexpr int kMaxSweeps = 8;
  const Scalar negligible = std::numeric_limits<Scalar>::epsilon() *
                            std::numeric_limits<Scalar>::epsilon() * Scalar(0.01);
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
    const Scalar off = m(0, 1) * m(0, 1) + m(0, 2) * m(0, 2) + m(1, 2) * m(1, 2);
    if (off <= negligible) break;
    jacobi_rotate(m, result.vectors, 0, 1, 2);
    jacobi_rotate(m, result.vectors, 0, 2, 1);
    jacobi_rotate(m, result.vectors, 1, 2, 0);
  }

  int order[3] = {0, 1, 2};
  if (m(order[1], order[1]) < m(order[0], order[0])) std::swap(order[0], order[1]);
  if (m(order[2], order[2]) < m(order[1], order[1])) std::swap(order[1], order[2]);
  if (m(order[1], order[1]) < m(order[0], order[0])) std::swap(order[0], order[1]);
  const Eigen::Matrix<Scalar, 3, 3> unsorted = result.vectors;
  for (int i = 0; i < 3; ++i) {
    result.values(i) = m(order[i], order[i]) * scale;
    result.vectors.col(i) = unsorted.col(order[i]);
  }
  return result;
}

template SymmetricEigen<float> symmetric_eigen(const Eigen::Matrix3f&) noexcept;
template SymmetricEigen<double> symmetric_eigen(const Eigen::Matrix3d&) noexcept;

}  // namespace unimapper
