// Mode of a spinning LiDAR, measured from a recording.
#pragma once

#include <cstdint>

#include "ports/datasets/dataset.hpp"
#include "unimapper/core/sensor.hpp"

namespace unimapper::apps {

/// Columns per turn of a spinning LiDAR whose first scan shows at least twice as many as its data
/// sheet does: what a preset has to make room for. 0: no more than that, or not measurable. Throws
/// DatasetError for a scan that cannot be read.
[[nodiscard]] std::uint32_t recorded_columns(const datasets::Dataset& dataset,
                                             const SensorModel& sensor);

}  // namespace unimapper::apps
