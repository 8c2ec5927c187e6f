// A LiDAR that no preset knows, from its data sheet.
#include <cstdio>
#include <unimapper/onboard/owned_pipeline.hpp>

int main() {
  using namespace unimapper;
  SensorModel lidar;
  lidar.name = "my-lidar-32";
  lidar.pattern = ScanPattern::kSpinning;
  lidar.horizontal_fov_deg = 360.0F;
  lidar.elevation_min_deg = -25.0F;
  lidar.elevation_max_deg = 15.0F;
  lidar.range_min_m = 0.5F;
  lidar.range_max_m = 80.0F;
  lidar.rings = 32;
  lidar.points_per_scan = 57600;
  lidar.scan_rate_hz = 10.0F;

  // Capacities and thresholds follow; what no LiDAR can have is refused in words.
  const Expected<PipelineConfig> config = preset(lidar, Computer::kJetson);
  if (!config) return std::puts(config.error().message), 1;
  std::printf("%.1f MB, %u points a scan, images of %.2f degrees a row\n",
              static_cast<double>(Pipeline::required_bytes(*config)) / 1e6,
              config->keyframe.max_points_per_scan,
              static_cast<double>(config->free_space.elevation_resolution_deg));
  OwnedPipeline pipeline(*config);
  if (!pipeline) return std::puts(pipeline.error().message), 1;

  lidar.rings = 0;  // forgotten
  std::printf("refused: %s\n", preset(lidar).error().message);
}
