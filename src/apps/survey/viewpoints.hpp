// Virtual viewpoints in a surveyed place.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace unimapper::apps {

/// Where virtual sensors stand.
struct ViewpointOptions {
  double spacing_m = 10.0;  ///< one viewpoint in each square of this edge that has ground
  double height_m = 1.8;    ///< of the sensor above the ground
};

/// Positions of sensors above ground that is free of obstacles up to the sensor, each as far from
/// obstacles as its square allows, in the order of a path from one to the nearest of the others.
/// Empty without ground. Of several storeys the lowest counts. Throws std::runtime_error for an
/// extent of more than 2^26 cells of 0.5 m, or more than 20,000 viewpoints. O(points + cells +
/// viewpoints²).
std::vector<Eigen::Vector3f> viewpoints(const std::vector<Eigen::Vector3f>& points,
                                        const ViewpointOptions& options);

}  // namespace unimapper::apps
