// Labels of every point, written back into the driver's own buffers.
#include <cstdio>
#include <unimapper/onboard/owned_pipeline.hpp>
#include <vector>

using namespace unimapper;

struct DriverPoint {  // whatever the driver delivers: the pipeline reads x, y, z at their offsets
  std::uint64_t stamp;
  float intensity, x, y, z;
  std::uint8_t moving;
};
using DriverScan = std::vector<DriverPoint>;
PointView view_of(const DriverScan& scan) {
  return {reinterpret_cast<const std::byte*>(scan.data()),
          scan.size(),
          sizeof(DriverPoint),
          offsetof(DriverPoint, x),
          offsetof(DriverPoint, y),
          offsetof(DriverPoint, z)};
}

int main() {
  OwnedPipeline pipeline(preset(SensorKind::kOs1_64));
  if (!pipeline) return std::puts(pipeline.error().message), 1;
  std::vector<DriverScan> scans;  // of the open keyframe: labels come when it closes
  for (std::int64_t k = 0; k < 10; ++k) {
    DriverScan& scan = scans.emplace_back(500, DriverPoint{});
    for (int i = 0; i < 500; ++i) scan[i].x = 12.0F, scan[i].y = 0.1F * i - 25.0F;
    if (!pipeline->add_scan(view_of(scan), Pose{}, k * 100'000'000).keyframe_ready) continue;
    std::vector<PointLabel> labels(500);
    for (std::size_t s = 0; s < scans.size(); ++s) {
      const std::size_t count = pipeline->labels(s, labels);
      for (std::size_t i = 0; i < count; ++i)
        scans[s][i].moving = labels[i] == PointLabel::kDynamic ? 1 : 0;
    }
    std::printf("%zu scans labelled\n", scans.size());
    scans.clear();
  }
}
