#include "src/apps/onboard/sensor_mode.hpp"

#include <algorithm>
#include <cmath>

#include "src/input/scan_sampling.hpp"

namespace unimapper::apps {

std::uint32_t recorded_columns(const datasets::Dataset& dataset, const SensorModel& sensor) {
  if (sensor.pattern != ScanPattern::kSpinning || dataset.scan_count() == 0) return 0;
  datasets::Scan scan;
  dataset.read_scan(0, scan);
  const auto sampling = input::measure_sampling(scan, sensor);
  if (!sampling || !(sampling->ray_spacing_deg > 0.0F)) return 0;
  const float assumed_deg = sampling->assumed_ray_spacing_deg;
  const long times = std::lround(assumed_deg / sampling->ray_spacing_deg);
  const long columns = std::lround(std::min(sensor.horizontal_fov_deg, 360.0F) / assumed_deg);
  return times >= 2 ? static_cast<std::uint32_t>(times * columns) : 0;
}

}  // namespace unimapper::apps
