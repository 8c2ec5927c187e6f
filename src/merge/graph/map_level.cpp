#include "map_level.hpp"

#include <Eigen/Geometry>
#include <cmath>

namespace unimapper::merge {

Eigen::Matrix3d rotation_to_z(const Eigen::Vector3d& up) {
  const Eigen::Vector3d from = up.normalized();
  const double c = from.z();
  if (c < -1.0 + 1e-12) return Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  // Not Eigen's FromTwoVectors: for the half turn it has a singular value decomposition, which
  // takes the compiler seconds.
  const Eigen::Vector3d axis = from.cross(Eigen::Vector3d::UnitZ());
  const double s = std::sqrt(2.0 * (1.0 + c));
  return Eigen::Quaterniond(0.5 * s, axis.x() / s, axis.y() / s, axis.z() / s)
      .normalized()
      .toRotationMatrix();
}

Eigen::Matrix3d levelling_rotation(std::span<const UpObservation> observations) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const UpObservation& observation : observations) {
    if (!observation.up.known) continue;
    const double variance = static_cast<double>(observation.up.variance_x) +
                            static_cast<double>(observation.up.variance_y);
    sum += observation.z_axis / variance;
  }
  if (!(sum.norm() > 0.0)) return Eigen::Matrix3d::Identity();
  return rotation_to_z(sum);
}

}  // namespace unimapper::merge
