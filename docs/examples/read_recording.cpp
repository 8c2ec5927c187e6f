// Reading a recording: KITTI, PCD, DynamicMap or HeLiPR, whatever the folder holds.
#include <cstdio>
#include <exception>

#include "ports/datasets/dataset.hpp"
#include "unimapper/onboard/owned_pipeline.hpp"

int main(int argc, char** argv) try {
  using namespace unimapper;
  if (argc != 2) return std::puts("usage: read_recording FOLDER"), 1;
  const auto recording = datasets::open_dataset(argv[1]);  // reads scans one at a time
  const SensorModel* sensor = find_sensor(recording->sensor());
  OwnedPipeline pipeline(preset(sensor != nullptr ? sensor->kind : SensorKind::kGeneric));
  if (!pipeline) return std::puts(pipeline.error().message), 1;

  datasets::Scan scan;
  for (std::size_t i = 0; i < recording->scan_count(); ++i) {
    recording->read_scan(i, scan);
    const ScanResult result =
        pipeline->add_scan(scan.view(), recording->pose(i), recording->stamp_ns(i));
    if (!result.error.ok()) std::printf("scan %zu: %s\n", i, result.error.message);
    if (!result.keyframe_ready) continue;
    const KeyframeView& keyframe = pipeline->keyframe();
    std::printf("keyframe %u: %zu static cells, %zu dynamic\n", keyframe.sequence,
                keyframe.static_cells.size(), keyframe.dynamic_cells.size());
  }
} catch (const std::exception& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 2;
}
