// Integer town seen from a tilted sensor in a leaning, turned odometry frame, the same bits
// everywhere
#pragma once

#include <cstdint>

#include "tests/onboard/integer_town.hpp"

namespace unimapper::regression {

using test::IntegerTown;
using test::TownScan;

/// Rotation of the quaternion (w, x, y, z) / norm of whole numbers: every entry is one quotient.
inline Eigen::Matrix3d whole_rotation(std::int64_t w, std::int64_t x, std::int64_t y,
                                      std::int64_t z) {
  const std::int64_t norm = w * w + x * x + y * y + z * z;
  const auto ratio = [norm](std::int64_t part) {
    return static_cast<double>(part) / static_cast<double>(norm);
  };
  Eigen::Matrix3d r;
  r << ratio(w * w + x * x - y * y - z * z), ratio(2 * (x * y - w * z)), ratio(2 * (x * z + w * y)),
      ratio(2 * (x * y + w * z)), ratio(w * w - x * x + y * y - z * z), ratio(2 * (y * z - w * x)),
      ratio(2 * (x * z - w * y)), ratio(2 * (y * z + w * x)), ratio(w * w - x * x - y * y + z * z);
  return r;
}

/// Product in one order of operations: Eigen's own differs between processors.
inline Eigen::Matrix3d product(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  Eigen::Matrix3d r;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      double sum = 0.0;
      for (int k = 0; k < 3; ++k) sum = sum + a(row, k) * b(k, column);
      r(row, column) = sum;
    }
  }
  return r;
}

inline Eigen::Vector3d product(const Eigen::Matrix3d& a, const Eigen::Vector3d& b) {
  Eigen::Vector3d r;
  for (int row = 0; row < 3; ++row) {
    r(row) = a(row, 0) * b(0) + a(row, 1) * b(1) + a(row, 2) * b(2);
  }
  return r;
}

/// Where the town lies in odometry's frame, and how the sensor is mounted.
struct Frames {
  Eigen::Matrix3d odometry_town = Eigen::Matrix3d::Identity();
  Eigen::Vector3d odometry_town_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d upright_sensor = Eigen::Matrix3d::Identity();

  /// The scan as that sensor measures it, with the pose that this odometry gives.
  [[nodiscard]] TownScan apply(const TownScan& scan) const {
    TownScan turned;
    const Eigen::Matrix3d sensor_upright = upright_sensor.transpose();
    for (std::size_t i = 0; i + 2 < scan.xyz.size(); i += 3) {
      const Eigen::Vector3d p(static_cast<double>(scan.xyz[i]),
                              static_cast<double>(scan.xyz[i + 1]),
                              static_cast<double>(scan.xyz[i + 2]));
      const Eigen::Vector3d q = product(sensor_upright, p);
      for (int axis = 0; axis < 3; ++axis) turned.xyz.push_back(static_cast<float>(q(axis)));
    }
    turned.T_odometry_sensor.rotation =
        product(odometry_town, product(scan.T_odometry_sensor.rotation, upright_sensor));
    const Eigen::Vector3d at = product(odometry_town, scan.T_odometry_sensor.translation);
    for (int axis = 0; axis < 3; ++axis) {
      turned.T_odometry_sensor.translation(axis) = at(axis) + odometry_town_m(axis);
    }
    return turned;
  }
};

/// Odometry leans by about 6 degrees and is turned by about 140, the sensor by 9 and 30.
inline Frames tilted() {
  Frames frames;
  frames.odometry_town = whole_rotation(34, 3, -5, 94);
  frames.odometry_town_m = {-250.0, 131.0, 42.5};
  frames.upright_sensor = whole_rotation(96, 5, 7, 25);
  return frames;
}

/// A scene that is quick to process.
inline IntegerTown::Options sparse(std::uint64_t seed) {
  IntegerTown::Options options;
  options.seed = seed;
  options.ground_points = 3500;
  options.points_per_block = 220;
  return options;
}

}  // namespace unimapper::regression
