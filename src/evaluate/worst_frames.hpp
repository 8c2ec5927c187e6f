// Ranking of a run's scans and objects by wrongly labelled points.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "dynamic.hpp"

namespace unimapper::evaluate {

/// Every scan's own score. O(points).
[[nodiscard]] std::vector<DynamicScore> score_frames(ScanSource& source);

/// The scans with the most wrongly labelled points, worst first: at most `count`, none without a
/// wrong point, and no two nearer than `gap` scans, because neighbours show the same.
[[nodiscard]] std::vector<std::size_t> worst_frames(std::span<const DynamicScore> frames,
                                                    std::size_t count, std::size_t gap = 10);

/// Labelling errors of one object in one scan. All points of a class without instance number are
/// one object.
struct ObjectErrors {
  std::uint32_t label = 0;                           ///< SemanticKITTI id, instance above
  Tally tally;                                       ///< its points in this scan
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< of its points, world
  Eigen::Vector3f wrong_center_sensor{Eigen::Vector3f::Zero()};  ///< of its wrong points, sensor
  float wrong_range_m = 0.0F;  ///< mean range of its wrong points, metres
};

/// Every object of a scan, the one with the most wrong points first. O(points).
[[nodiscard]] std::vector<ObjectErrors> errors_by_object(const ScoredScan& scan);

/// Distance between the centroids of an object's points in two scans, metres; NaN if it is not in
/// both. Also grows while more of the object comes into view.
[[nodiscard]] double displacement_m(const ObjectErrors& object,
                                    std::span<const ObjectErrors> other_scan);

}  // namespace unimapper::evaluate
