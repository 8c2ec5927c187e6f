// Poses of a dataset's sensor at any time.
#pragma once

#include <cstdint>
#include <vector>

#include "ports/datasets/dataset.hpp"

namespace unimapper::datasets {

/// The dataset's `pose_at` where it has a pose; elsewhere those of its scans, interpolated.
class SensorMotion {
 public:
  /// `dataset` must outlive this. O(scans).
  explicit SensorMotion(const Dataset& dataset);

  /// T_odometry_sensor: between scans translation linear, rotation by slerp; before the first and
  /// after the last the motion of the outermost interval goes on, for as long as that at most.
  [[nodiscard]] Pose at(std::int64_t stamp_ns) const;

 private:
  const Dataset& dataset_;
  // Strictly rising stamps of scans and their poses.
  std::vector<std::int64_t> stamps_ns_;
  std::vector<Pose> poses_;
};

}  // namespace unimapper::datasets
