// Sampling of one scan, measured by the pipeline itself
#pragma once

#include <optional>

#include "ports/datasets/dataset.hpp"
#include "unimapper/core/sensor.hpp"

namespace unimapper::input {

/// Angles between neighbouring rays, degrees; 0: not measured.
struct ScanSampling {
  float ray_spacing_deg = 0.0F;          ///< along a ring
  float ring_spacing_deg = 0.0F;         ///< from ring to ring
  float assumed_ray_spacing_deg = 0.0F;  ///< what the sensor's preset takes it for
};

/// Puts one scan through the smallest pipeline with the sensor's preset. Empty where it gives no
/// keyframe.
[[nodiscard]] std::optional<ScanSampling> measure_sampling(const datasets::Scan& scan,
                                                           const SensorModel& sensor);

}  // namespace unimapper::input
