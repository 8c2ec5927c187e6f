#include "nearest_rotation.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "symmetric_eigen.hpp"

namespace unimapper {

NearestRotation nearest_rotation(const Eigen::Matrix3d& m) noexcept {
  // Singular vectors of m = U S V^T by the eigenvectors V of its square. The two strongest
  // directions decide; the third follows as their cross product on both sides, which makes the
  // rotation proper whatever the sign or size of the weakest singular value.
  const SymmetricEigen<double> square = symmetric_eigen<double>(m.transpose() * m);
  if (!(square.values(1) > 1e-12 * square.values(2)) || !(square.values(2) > 0.0)) return {};
  Eigen::Matrix3d v;
  v.col(0) = square.vectors.col(2);
  v.col(1) = square.vectors.col(1);
  v.col(2) = v.col(0).cross(v.col(1));
  Eigen::Matrix3d u;
  u.col(0) = (m * v.col(0)).normalized();
  u.col(1) = m * v.col(1);
  u.col(1) = (u.col(1) - u.col(0) * u.col(0).dot(u.col(1))).normalized();
  u.col(2) = u.col(0).cross(u.col(1));
  return {u * v.transpose(), std::sqrt(square.values(1))};
}

}  // namespace unimapper
