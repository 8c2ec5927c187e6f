// Motion of the sensor during one sweep.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "ports/datasets/dataset.hpp"
#include "ports/datasets/sensor_motion.hpp"

namespace unimapper::datasets {

/// What the times of a scan's points are taken for.
struct TimeReading {
  double sign = 1.0;      ///< -1: the times run backwards
  double offset_s = 0.0;  ///< added to the times
};

/// Moves points from the sensor's frame of their own times to that of the scan's stamp.
class SweepMotion {
 public:
  /// Poses of the times of `scan`, about every millisecond. The scan's `time_s` is not empty.
  SweepMotion(const SensorMotion& poses, std::int64_t stamp_ns, const Scan& scan,
              const TimeReading& reading = {});

  /// The point at the stamp. O(1).
  [[nodiscard]] Eigen::Vector3f operator()(const Scan::Point& point, float time_s) const;

 private:
  struct Step {
    Eigen::Matrix3f rotation;
    Eigen::Vector3f translation;
  };
  float first_s_;
  float steps_per_s_;
  std::vector<Step> T_stamp_time_;
};

/// Motion of every point of `scan` to its stamp undone in place. Points that are not finite stay.
void deskew(const SensorMotion& poses, std::int64_t stamp_ns, Scan& scan);

}  // namespace unimapper::datasets
