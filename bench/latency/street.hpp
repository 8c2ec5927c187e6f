// Procedural scan generator: an endless street with a given number of points per scan.
//
// For cost curves only; labelled recordings come from src/simulator.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <random>
#include <vector>

namespace unimapper::bench {

/// Level ground 1.8 m below the sensor, and house fronts of different depths every 15 m.
class Street {
 public:
  explicit Street(std::uint32_t seed) : random_(seed) {}

  /// `count` points in random directions for a sensor at `x_m` along the street.
  [[nodiscard]] std::vector<Eigen::Vector3f> scan(double x_m, std::size_t count);

 private:
  [[nodiscard]] Eigen::Vector3f cast_ray(double x_m);

  std::mt19937 random_;
};

}  // namespace unimapper::bench
