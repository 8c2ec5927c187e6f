#include "unimapper/place/rigid_fit.hpp"

#include <cmath>

#include "unimapper/core/symmetric_eigen.hpp"

namespace unimapper {

bool fit_rigid(std::span<const PointPair> pairs, Pose& T_b_a) noexcept {
  if (pairs.size() < 3) return false;
  Eigen::Vector3d mean_a = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean_b = Eigen::Vector3d::Zero();
  for (const PointPair& pair : pairs) {
    mean_a += pair.a;
    mean_b += pair.b;
  }
  mean_a /= static_cast<double>(pairs.size());
  mean_b /= static_cast<double>(pairs.size());
  Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();  // sum of b a^T
  for (const PointPair& pair : pairs) cross += (pair.b - mean_b) * (pair.a - mean_a).transpose();

  // Singular vectors of `cross` = U S V^T by the eigenvectors V of its square. The two strongest
  // directions decide; the third follows as their cross product on both sides, which makes the
  // rotation proper whatever the sign or size of the weakest singular value.
  const SymmetricEigen<double> square = symmetric_eigen<double>(cross.transpose() * cross);
  if (!(square.values(1) > 1e-12 * square.values(2)) || !(square.values(2) > 0.0)) return false;
  Eigen::Matrix3d v;
  v.col(0) = square.vectors.col(2);
  v.col(1) = square.vectors.col(1);
  v.col(2) = v.col(0).cross(v.col(1));
  Eigen::Matrix3d u;
  u.col(0) = (cross * v.col(0)).normalized();
  u.col(1) = cross * v.col(1);
  u.col(1) = (u.col(1) - u.col(0) * u.col(0).dot(u.col(1))).normalized();
  u.col(2) = u.col(0).cross(u.col(1));
  T_b_a.rotation = u * v.transpose();
  T_b_a.translation = mean_b - T_b_a.rotation * mean_a;
  return T_b_a.is_finite();
}

PlanarPose seen_from_above(const Pose& pose) noexcept {
  const auto dot = static_cast<float>(pose.rotation(0, 0) + pose.rotation(1, 1));
  const auto cross = static_cast<float>(pose.rotation(1, 0) - pose.rotation(0, 1));
  const float norm = std::sqrt(dot * dot + cross * cross);
  PlanarPose planar;
  if (norm > 0.0F) {
    planar.cosine = dot / norm;
    planar.sine = cross / norm;
  }
  planar.x = static_cast<float>(pose.translation.x());
  planar.y = static_cast<float>(pose.translation.y());
  return planar;
}

bool fit_planar(const Eigen::Vector2f* a, const Eigen::Vector2f* b, std::uint32_t count,
                PlanarPose& T_b_a) noexcept {
  if (count == 0) return false;
  Eigen::Vector2f mean_a = Eigen::Vector2f::Zero();
  Eigen::Vector2f mean_b = Eigen::Vector2f::Zero();
  for (std::uint32_t i = 0; i < count; ++i) {
    mean_a += a[i];
    mean_b += b[i];
  }
  mean_a /= static_cast<float>(count);
  mean_b /= static_cast<float>(count);
  float dot = 0.0F;
  float cross = 0.0F;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Eigen::Vector2f p = a[i] - mean_a;
    const Eigen::Vector2f q = b[i] - mean_b;
    dot += p.x() * q.x() + p.y() * q.y();
    cross += p.x() * q.y() - p.y() * q.x();
  }
  const float norm = std::sqrt(dot * dot + cross * cross);
  if (!(norm > 1e-6F)) return false;
  T_b_a.cosine = dot / norm;
  T_b_a.sine = cross / norm;
  T_b_a.x = mean_b.x() - (T_b_a.cosine * mean_a.x() - T_b_a.sine * mean_a.y());
  T_b_a.y = mean_b.y() - (T_b_a.sine * mean_a.x() + T_b_a.cosine * mean_a.y());
  return true;
}

}  // namespace unimapper
