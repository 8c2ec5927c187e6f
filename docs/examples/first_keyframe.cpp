// First keyframe: scans and odometry poses in, static cells out.
#include <cstdio>
#include <unimapper/onboard/owned_pipeline.hpp>

int main() {
  using namespace unimapper;
  OwnedPipeline pipeline(preset(SensorKind::kOs2_128));  // the only time the heap is asked
  if (!pipeline) return std::puts(pipeline.error().message), 1;

  float scan[1000][3];  // your driver's buffer: any stride, never copied
  for (int i = 0; i < 1000; ++i) scan[i][0] = 10, scan[i][1] = 0.1F * i - 50, scan[i][2] = -1;
  for (std::int64_t k = 0; k < 10; ++k) {
    const Pose T_odometry_sensor;  // from your odometry
    const ScanResult result = pipeline->add_scan(PointView::xyz(scan, 1000, sizeof scan[0]),
                                                 T_odometry_sensor, k * 100'000'000);
    if (!result.error.ok()) std::puts(result.error.message);  // refused: the next scan may do
    if (result.keyframe_ready)
      std::printf("keyframe: %zu static cells\n", pipeline->keyframe().static_cells.size());
  }
}
