// Known positions of keyframes: satellites, surveys, heights of floors.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>

#include "unimapper/core/ids.hpp"

namespace unimapper::merge {

/// A position of a point that moves with a keyframe, in the site frame: Cartesian, z up, the same
/// for all positions of a merge.
struct KnownPosition {
  KeyframeId keyframe;       ///< the keyframe it belongs to
  Eigen::Vector3d position;  ///< site frame, metres; x and y count for nothing if only z is known
  /// The point, levelled keyframe frame, metres: zero is the sensor, else a lever arm.
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  /// Standard deviation of x and of y, metres; infinite: only the height is known.
  double sigma_xy_m = std::numeric_limits<double>::infinity();
  double sigma_z_m = 1.0;  ///< standard deviation of z, metres

  /// Whether x and y are known.
  [[nodiscard]] bool is_horizontal() const { return std::isfinite(sigma_xy_m); }
};

/// What a merge made of a known position.
struct PositionOutcome {
  KnownPosition given;         ///< as it was given
  bool used = false;           ///< part of the pose graph
  std::string reason;          ///< why it was not used, empty otherwise
  Eigen::Vector3d residual_m;  ///< the map's position less the given one; of a used one
};

/// Where the map lies in the site frame: by `origin`, without rotation.
struct Georeference {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< of the map frame in the site frame, metres
  bool is_horizontal = false;                        ///< x and y are known, not the height alone
  /// Standard deviation of the map's heading by the positions, radians; infinite: unknown, the
  /// heading is that of the central session's odometry.
  double heading_sigma_rad = std::numeric_limits<double>::infinity();
};

}  // namespace unimapper::merge
