// Pseudo-random poses and vectors that are the same with every standard library.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

#include "tests/random.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::merge::testing {

class Random : public test::Random {
 public:
  explicit Random(std::uint64_t seed) : test::Random(mix_bits(seed + 0x9E3779B97F4A7C15ULL)) {}

  std::size_t below(std::size_t n) {
    return static_cast<std::size_t>(uniform() * static_cast<double>(n));
  }
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * 3.14159265358979323846 * uniform());
  }
  Eigen::Vector3d normal3(double sigma) {
    return {sigma * normal(), sigma * normal(), sigma * normal()};
  }

  /// A small pose with the given standard deviations per axis.
  Pose pose(double sigma_m, double sigma_rad) {
    const Eigen::Vector3d rotation = normal3(sigma_rad);
    const Eigen::Vector3d translation = normal3(sigma_m);
    const double angle = rotation.norm();
    if (angle < 1e-12) return {Eigen::Matrix3d::Identity(), translation};
    return {Eigen::Quaterniond(Eigen::AngleAxisd(angle, rotation / angle)), translation};
  }
};

}  // namespace unimapper::merge::testing
