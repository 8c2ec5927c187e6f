// Noise of given poses, from scan to scan
#include "src/input/pose_noise.hpp"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <span>

#include "src/core/quantile.hpp"

namespace unimapper::input {

Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& r) {
  const Eigen::AngleAxisd turn(r);
  return turn.angle() * turn.axis();
}

double scale_of(std::vector<double> magnitudes) {
  constexpr double kNormal = 1.4826;
  return magnitudes.empty() ? 0.0 : kNormal * median(std::span(magnitudes));
}

Twist measure_pose_noise(const Track& track) {
  constexpr std::size_t kMost = 400;
  const double gain = std::sqrt(70.0);  // 1 -4 6 -4 1
  std::array<std::vector<double>, 6> magnitudes;
  const std::size_t step = 1 + track.size / kMost;
  for (std::size_t i = 2; i + 2 < track.size; i += step) {
    const Pose T_pose_world = track.pose(i).inverse();
    const auto at = [&](std::size_t j) {
      const Pose moved = T_pose_world * track.pose(j);
      Twist twist;
      twist << rotation_vector(moved.rotation), moved.translation;
      return twist;
    };
    const Twist difference = at(i - 2) - 4.0 * (at(i - 1) + at(i + 1)) + at(i + 2);
    for (std::size_t c = 0; c < 6; ++c) {
      magnitudes[c].push_back(std::fabs(difference[static_cast<Eigen::Index>(c)]) / gain);
    }
  }
  Twist sigmas;
  for (std::size_t c = 0; c < 6; ++c) {
    sigmas[static_cast<Eigen::Index>(c)] = scale_of(std::move(magnitudes[c]));
  }
  return sigmas;
}

double attitude_noise_deg(const Twist& noise) {
  return noise.head<2>().maxCoeff() * kDegreesPerRadian;
}

}  // namespace unimapper::input
