// Eigenvalues and eigenvectors of symmetric 3x3 matrices.
#pragma once

#include <Eigen/Core>

namespace unimapper {

/// Eigen decomposition of a symmetric 3x3 matrix: `m = vectors * values.asDiagonal() * vectors^T`.
template <typename Scalar>
struct SymmetricEigen {
  Eigen::Matrix<Scalar, 3, 1> values = Eigen::Matrix<Scalar, 3, 1>::Zero();  ///< ascending
  /// Orthonormal columns in the order of `values`. The sign of a column is arbitrary but the
  /// same for the same input.
  Eigen::Matrix<Scalar, 3, 3> vectors = Eigen::Matrix<Scalar, 3, 3>::Identity();
};

/// Decomposes `matrix` (of float or double), of which only the symmetric part's upper triangle is
/// read. Cyclic Jacobi rotations: backward stable for repeated and vanishing eigenvalues, where
/// closed formulas by the characteristic polynomial lose the eigenvectors; only square roots, so
/// the same bits on every machine. Input that is zero or not finite gives zero values and the
/// identity. Cost: at most `8 x 3` rotations, usually 3 sweeps; about 0.15 us.
template <typename Scalar>
[[nodiscard]] SymmetricEigen<Scalar> symmetric_eigen(
    const Eigen::Matrix<Scalar, 3, 3>& matrix) noexcept;

// Compiled once, in the core: a copy in a program that lets Eigen use NEON would not compute the
// same bits, and the linker might take that one for all.
extern template SymmetricEigen<float> symmetric_eigen(const Eigen::Matrix3f&) noexcept;
extern template SymmetricEigen<double> symmetric_eigen(const Eigen::Matrix3d&) noexcept;

}  // namespace unimapper
