// The proper rotation nearest to a 3x3 matrix.
#pragma once

#include <Eigen/Core>

namespace unimapper {

/// A rotation and how surely its matrix says it.
struct NearestRotation {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< orthonormal, determinant 1
  /// Second singular value of the matrix, in its units: two directions fix the third, so this
  /// one decides. Zero: the matrix says nothing about a rotation, which then is the identity.
  double deciding_value = 0.0;
};

/// The proper rotation R that maximises trace(R^T m): of m = sum of b a^T over pairs of centred
/// points the least-squares turn of a onto b, of a distorted rotation the nearest true one. Never
/// a reflection: the weakest direction is turned over where the free optimum would be one.
/// Cost: one 3x3 eigen decomposition; only square roots, so the same bits on every machine.
[[nodiscard]] NearestRotation nearest_rotation(const Eigen::Matrix3d& m) noexcept;

}  // namespace unimapper
