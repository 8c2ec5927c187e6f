#include "map_level.hpp"

#include <Eigen/Geometry>

namespace unimapper::merge {

Eigen::Matrix3d levelling_rotation(std::span<const UpObservation> observations) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const UpObservation& observation : observations) {
    if (!observation.up.known) continue;
    const double variance = static_cast<double>(observation.up.variance_x) +
                            static_cast<double>(observation.up.variance_y);
    sum += observation.z_axis / variance;
  }
  if (!(sum.norm() > 0.0)) return Eigen::Matrix3d::Identity();
  return Eigen::Quaterniond::FromTwoVectors(sum, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

}  // namespace unimapper::merge
