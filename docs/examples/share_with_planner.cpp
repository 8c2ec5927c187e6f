// Shared memory: a planner on the same robot reads static cells without a copy.
#include <cstdio>
#include <set>
#include <unimapper/onboard/owned_pipeline.hpp>
#include <utility>

#include "ports/shared_memory/content_reader.hpp"
#include "ports/shared_memory/pipeline_share.hpp"
#include "ports/shared_memory/reader.hpp"

using namespace unimapper;
using namespace unimapper::shared_memory;

int main(int argc, char** argv) {
  const char* name = argc > 1 ? argv[1] : "robot7";  // whoever knows it reads along
  const PipelineConfig config = preset(SensorKind::kVlp16, Computer::kJetson);
  OwnedPipeline pipeline(config);
  PipelineShare share;  // the robot: loan, fill and publish behind `after_scan`
  const Outcome opened = share.open(name, config, {7, 20260122});
  if (!pipeline || !opened.ok) return std::puts(opened.message), 1;
  Reader planner;  // in a process of its own, usually
  ReaderOptions options;
  options.content = content_of(ContentKind::kKeyframe);
  if (const auto joined = planner.open(name, kKeyframeTopic, options); !joined.ok)
    return std::puts(joined.message), 1;

  float scan[1000][3] = {};
  for (int i = 0; i < 1000; ++i) scan[i][0] = 10, scan[i][1] = 0.1F * i - 50;
  for (std::int64_t k = 1; k <= 20; ++k) {
    share.after_scan(*pipeline, pipeline->add_scan(PointView::xyz(scan, 1000, 12), {}, k * 100));
    Sample sample;  // the keyframe stays as it is until this is gone
    if (planner.take(sample) != Taken::kMessage) continue;  // a planner would `wait`
    const auto keyframe = read_keyframe(sample.bytes());
    if (!keyframe) continue;  // nonsense is refused
    std::set<std::pair<int, int>> blocked;
    for (const SharedCell cell : keyframe->static_cells)
      if (cell.ground == 0) blocked.emplace(cell.position[0] * 5, cell.position[1] * 5);
    std::printf("keyframe %u: %zu squares blocked\n", keyframe->fixed.head.number, blocked.size());
  }
}
