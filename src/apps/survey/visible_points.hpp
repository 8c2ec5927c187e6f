// Points of a cloud that are visible from a place.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "src/apps/survey/survey_cloud.hpp"

namespace unimapper::apps {

/// The points within `range_m` that no nearer ones hide, from `viewpoint`, in the axes of the
/// cloud. A point hides what lies behind 0.15 m about it, or behind a pixel of 0.5 degrees, by more
/// than 0.3 m and a tenth of its range: so much ground between two rings counts as seen. O(points
/// in range).
std::vector<Eigen::Vector3f> visible_points(const PointTiles& cloud,
                                            const Eigen::Vector3f& viewpoint, float range_m);

}  // namespace unimapper::apps
