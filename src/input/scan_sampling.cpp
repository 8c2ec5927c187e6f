#include "src/input/scan_sampling.hpp"

#include <algorithm>
#include <cstdint>

#include "unimapper/onboard/owned_pipeline.hpp"

namespace unimapper::input {
namespace {

PipelineConfig smallest_config(const SensorModel& sensor, std::size_t points) {
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

std::optional<ScanSampling> measure_sampling(const datasets::Scan& scan,
                                             const SensorModel& sensor) {
  OwnedPipeline pipeline(smallest_config(sensor, scan.points.size()));
  if (!pipeline.ok()) return std::nullopt;
  if (!pipeline->add_scan(scan.view(), Pose(), 0).keyframe_ready) return std::nullopt;
  const SamplingStatistics& sampling = pipeline->keyframe().statistics->sampling;
  return ScanSampling{sampling.ray_spacing_deg, sampling.ring_spacing_deg,
                      pipeline->config().free_space.ray_spacing_deg};
}

}  // namespace unimapper::input
