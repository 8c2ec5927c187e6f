// Short calls: a keyframe is closed, and finished, between the scans that follow it.
#include <cstdio>
#include <ctime>
#include <unimapper/onboard/owned_pipeline.hpp>

using namespace unimapper;

std::int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * std::int64_t{1'000'000'000} + now.tv_nsec;
}

int main() {
  PipelineConfig config = preset(SensorKind::kVlp16);
  config.deferred = true;
  config.clock_ns = monotonic_ns;
  OwnedPipeline pipeline(config);
  if (!pipeline) return std::puts(pipeline.error().message), 1;
  const auto look = [&](const auto& result) {
    if (result.keyframe_ready)  // `labels` and `keyframe` tell what was decided
      std::printf("keyframe %u ready\n", pipeline->keyframe().sequence);
    if (!result.keyframe_finished) return;
    const KeyframeView& keyframe = pipeline->finished_keyframe();  // complete: cells, place, loops
    std::printf("keyframe %u finished: %zu planes\n", keyframe.sequence,
                keyframe.place.planes.size());
  };
  float scan[4000][3];
  for (int i = 0; i < 4000; ++i)
    scan[i][0] = 10, scan[i][1] = 0.25F * float(i % 80 - 40), scan[i][2] = 0.1F * float(i / 80);
  for (std::int64_t k = 0; k < 25; ++k) {
    look(pipeline->add_scan(PointView::xyz(scan, 4000, 12), Pose{}, k * 100'000'000));
    look(pipeline->work(500));  // half a millisecond is to spare
  }
  ScanResult last;
  do {  // end of the run: what is open, and what is left
    last = pipeline->flush();
    look(last);
  } while (last.keyframe_finished);
}
