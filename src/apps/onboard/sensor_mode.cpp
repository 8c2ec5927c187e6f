#include "src/apps/onboard/sensor_mode.hpp"

#include <algorithm>
#include <cmath>

#include "unimapper/onboard/owned_pipeline.hpp"

namespace unimapper::apps {
namespace {

/// The smallest pipeline that measures a scan of `points` points.
PipelineConfig probe(const SensorModel& sensor, std::size_t points) {
  const auto model = preset(sensor, Computer::kServer);
  PipelineConfig config = model.ok() ? model.value() : preset(SensorKind::kGeneric);
  config.keyframe.scans = 1;
  config.free_space.images_per_keyframe = 1;
  config.removal.window = 1;
  constexpr std::size_t kFewest = 16;
  constexpr std::size_t kMost = 4194304;
  config.keyframe.max_points_per_scan =
      static_cast<std::uint32_t>(std::clamp(points, kFewest, kMost));
  config.voxel.max_cells = 1U << 16U;
  config.voxel.max_window_blocks = 1U << 16U;
  config.loop_search.max_places = 16;
  return config;
}

}  // namespace

std::uint32_t recorded_columns(const datasets::Dataset& dataset, const SensorModel& sensor) {
  if (sensor.pattern != ScanPattern::kSpinning || dataset.scan_count() == 0) return 0;
  datasets::Scan scan;
  dataset.read_scan(0, scan);
  OwnedPipeline pipeline(probe(sensor, scan.points.size()));
  if (!pipeline.ok()) return 0;
  if (!pipeline->add_scan(scan.view(), dataset.pose(0), dataset.stamp_ns(0)).keyframe_ready) {
    return 0;
  }
  const float measured_deg = pipeline->keyframe().statistics->sampling.ray_spacing_deg;
  if (!(measured_deg > 0.0F)) return 0;
  const float assumed_deg = pipeline->config().free_space.ray_spacing_deg;
  const long times = std::lround(assumed_deg / measured_deg);
  const long columns = std::lround(std::min(sensor.horizontal_fov_deg, 360.0F) / assumed_deg);
  return times >= 2 ? static_cast<std::uint32_t>(times * columns) : 0;
}

}  // namespace unimapper::apps
