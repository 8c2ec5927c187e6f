// Registration of a thinned scan to the local map.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "gyroscope.hpp"
#include "local_map.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::odometry {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

/// The two scales of the local map, fine and coarse.
using Maps = std::span<LocalMap, 2>;

/// A point to register, and where it was last found to be in either map.
struct SourcePoint {
  Eigen::Vector3f position_m = Eigen::Vector3f::Zero();  ///< sensor's frame of its own time
  float time_s = 0.0F;                                   ///< after the middle of the scan
  LocalMap::Neighbourhood neighbourhood[2];
};

/// Normal equations of a small motion: translation along the odometry frame's axes (m), then
/// rotation about them through the sensor (rad).
struct NormalEquations {
  Matrix6d matrix = Matrix6d::Zero();
  Vector6d right = Vector6d::Zero();
  double weight = 0.0;      ///< sum of the points' weights
  double squares_m2 = 0.0;  ///< weighted sum of squared distances from the surfaces
};

/// How well the points determine directions of the odometry frame.
struct Determination {
  /// Unit vectors, one in each column: three of translation, then three of rotation.
  Eigen::Matrix<double, 3, 6> axes = Eigen::Matrix<double, 3, 6>::Zero();
  Vector6d share = Vector6d::Zero();  ///< share of the points that say much about each of them
};

/// How strictly points are registered.
struct Tolerance {
  double kernel_m = 1.0;   ///< points so far from their surface count a quarter
  double sparse_m = 1.0;   ///< that kernel along directions that few points determine
  double reach_m = 1.0;    ///< points farther from their surface do not count
  bool is_coarse = false;  ///< to the coarse map alone
  int iterations = 30;     ///< at most
};

/// The time from the middle of the scan before to that of this one, and the pose then.
struct Interval {
  Pose T_odometry_before;
  double seconds = 0.1;
  const SweepTurns* turns = nullptr;  ///< within the sweep, where a gyroscope knows them
};

/// Where the sensor is expected to be, for directions that few points determine.
struct Expectation {
  Pose pose;
  bool is_known = false;  ///< whether there is a velocity that it comes from
  double off_m = 0.0;     ///< by how much the last velocities let another place be expected
};

/// A pose and how it was found.
struct Registered {
  Pose pose;  ///< T_odometry_sensor in the middle of the scan
  NormalEquations equations;
  Determination determination;
  bool is_valid = false;  ///< whether the equations had a solution
};

/// Finds the pose at which the points fit the map, beginning at `start`. Along directions that few
/// points say much about, only these count, together with what is expected.
[[nodiscard]] Registered register_points(std::span<SourcePoint> points, Maps maps,
                                         const Interval& interval, const Pose& start,
                                         const Expectation& expectation,
                                         const Tolerance& tolerance) noexcept;

/// How well points fit the map at a pose, from 0 to 1: the mean of their robust weights.
[[nodiscard]] double fit_of(std::span<SourcePoint> points, Maps maps, const Interval& interval,
                            const Pose& pose, double kernel_m) noexcept;

}  // namespace unimapper::odometry
