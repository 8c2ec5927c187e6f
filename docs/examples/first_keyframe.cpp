// First keyframe: scans and odometry poses in, static cells out.
#include <cstdio>
#include <unimapper/onboard/owned_pipeline.hpp>
#include <vector>

int main() {
  using namespace unimapper;
  OwnedPipeline pipeline(preset(SensorKind::kOs2_128));  // the only time the heap is asked
  if (!pipeline) return 1;                               // pipeline.error().message says why
  std::vector<Eigen::Vector3f> scan;  // your driver's buffer: any stride, never copied
  for (int i = 0; i < 1000; ++i) scan.emplace_back(10.0F, 0.1F * i - 50.0F, -1.0F);
  const PointView points = PointView::xyz(scan.data(), scan.size(), sizeof(Eigen::Vector3f));
  for (std::int64_t k = 0; k < 10; ++k) {
    const Pose T_odometry_sensor;  // from your odometry
    const ScanResult result = pipeline->add_scan(points, T_odometry_sensor, k * 100'000'000);
    if (!result.error.ok()) std::puts(result.error.message);  // refused: the next scan may do
    if (result.keyframe_ready)
      std::printf("keyframe: %zu static cells\n", pipeline->keyframe().static_cells.size());
  }
}
