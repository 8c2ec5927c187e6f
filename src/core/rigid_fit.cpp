#include "rigid_fit.hpp"

#include <cmath>

#include "nearest_rotation.hpp"

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

  const NearestRotation fit = nearest_rotation(cross);
  if (!(fit.deciding_value > 0.0)) return false;
  T_b_a.rotation = fit.rotation;
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
