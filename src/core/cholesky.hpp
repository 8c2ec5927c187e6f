// Cholesky factorisation of small symmetric positive definite systems.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace unimapper {

/// Cholesky factor L L^T of a small symmetric positive definite matrix, of which the lower
/// triangle is read. Plain loops in a fixed order: the same bits on every machine, and no more
/// code than the size needs. Check `valid()` before use: false for a matrix that is not positive
/// definite or not finite.
template <int N>
class Cholesky {
 public:
  /// The matrix that is factorised.
  using Matrix = Eigen::Matrix<double, N, N>;
  /// Right-hand side and solution.
  using Vector = Eigen::Matrix<double, N, 1>;

  explicit Cholesky(const Matrix& matrix) noexcept : factor_(Matrix::Zero()) {
    for (int col = 0; col < N; ++col) {
      for (int row = col; row < N; ++row) {
        double sum = matrix(row, col);
        for (int k = 0; k < col; ++k) sum -= factor_(row, k) * factor_(col, k);
        if (row == col) {
          if (!(sum > 0.0) || !std::isfinite(sum)) return;
          factor_(col, col) = std::sqrt(sum);
        } else {
          factor_(row, col) = sum / factor_(col, col);
        }
      }
    }
    valid_ = true;
  }

  /// Whether the matrix was positive definite and finite.
  [[nodiscard]] bool valid() const noexcept { return valid_; }

  /// x of `matrix * x = right`; zero if not valid.
  [[nodiscard]] Vector solve(const Vector& right) const noexcept {
    Vector x = Vector::Zero();
    if (!valid_) return x;
    for (int row = 0; row < N; ++row) {
      double sum = right(row);
      for (int k = 0; k < row; ++k) sum -= factor_(row, k) * x(k);
      x(row) = sum / factor_(row, row);
    }
    for (int row = N - 1; row >= 0; --row) {
      double sum = x(row);
      for (int k = row + 1; k < N; ++k) sum -= factor_(k, row) * x(k);
      x(row) = sum / factor_(row, row);
    }
    return x;
  }

  /// L^-1 times each column; nothing if not valid.
  template <int M>
  void whiten(Eigen::Matrix<double, N, M>& columns) const noexcept {
    if (!valid_) return;
    for (int col = 0; col < M; ++col) {
      for (int row = 0; row < N; ++row) {
        double sum = columns(row, col);
        for (int k = 0; k < row; ++k) sum -= factor_(row, k) * columns(k, col);
        columns(row, col) = sum / factor_(row, row);
      }
    }
  }

  /// Of the factor L.
  [[nodiscard]] double diagonal(int i) const noexcept { return factor_(i, i); }

  /// Inverse of the matrix, exactly symmetric; zero if not valid.
  [[nodiscard]] Matrix inverse() const noexcept {
    Matrix result;
    for (int col = 0; col < N; ++col) {
      const Vector column = solve(Vector::Unit(col));
      for (int row = 0; row < N; ++row) result(row, col) = column(row);
    }
    for (int col = 0; col < N; ++col) {
      for (int row = 0; row < col; ++row) {
        result(row, col) = result(col, row) = 0.5 * (result(row, col) + result(col, row));
      }
    }
    return result;
  }

 private:
  Matrix factor_;
  bool valid_ = false;
};

}  // namespace unimapper
