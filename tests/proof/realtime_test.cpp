// Proof that the pipeline makes no blocking call, by RealtimeSanitizer.
//
// Its runtime intercepts what may block or take unbounded time: memory allocation, locks, sleeping,
// files, sockets, threads.
//
//   proof_realtime                        the pipeline; fails on the first such call
//   proof_realtime malloc|mutex|output    proves that the interception works
#include <pthread.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "tests/proof/runs.hpp"
#include "tests/proof/watched_workers.hpp"

extern "C" {
void __rtsan_init();
void __rtsan_realtime_enter();
void __rtsan_realtime_exit();
}

namespace {

using namespace unimapper;
using namespace unimapper::test;

/// Everything between construction and destruction is a real-time context.
struct RealtimeContext {
  RealtimeContext() { __rtsan_realtime_enter(); }
  ~RealtimeContext() { __rtsan_realtime_exit(); }
};

void commit(const char* sin) {
  static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
  const RealtimeContext context;
  if (std::strcmp(sin, "malloc") == 0) std::free(std::malloc(1));
  if (std::strcmp(sin, "mutex") == 0) pthread_mutex_lock(&mutex);
  if (std::strcmp(sin, "output") == 0) std::puts("output");
}

unsigned drive(const PipelineConfig& config, const std::vector<LabelledScan>& scans) {
  OwnedPipeline pipeline(config);
  Encoding encoding(config);
  std::vector<PointLabel> labels(100000);
  unsigned keyframes = 0;
  std::int64_t stamp = 0;
  const RealtimeContext context;
  for (const LabelledScan& scan : scans) {
    (void)pipeline->add_scan(PointView{}, sensor_at(0, 0), stamp + 1);
    const ScanResult result =
        pipeline->add_scan(scan.view(), sensor_at(0.1 * keyframes, 0), ++stamp);
    if (result.keyframe_ready) read_labels(pipeline, labels);
    const bool finished = result.keyframe_finished || pipeline->work(500).keyframe_finished;
    if (finished && encoding.encode(pipeline->finished_keyframe())) ++keyframes;
  }
  (void)pipeline->add_scan(scans.front().view(), sensor_at(500.0, 0), ++stamp);
  (void)pipeline->flush();
  return keyframes;
}

}  // namespace

int main(int argc, char** argv) {
  __rtsan_init();
  if (argc > 1) {
    commit(argv[1]);
    std::puts("not caught");
    return 1;
  }
  const std::vector<LabelledScan> scans = scans_of_street(35);

  PipelineConfig both = small_config();
  both.free_space.columns = true;
  PipelineConfig thinned = small_config();
  thinned.keyframe.downsample_leaf_m = 0.1F;
  WatchedWorkers<RealtimeContext> workers(2);
  PipelineConfig helped = both;
  helped.executor = workers.executor();
  for (const PipelineConfig& config : {both, thinned, helped}) {
    const unsigned keyframes = drive(config, scans);
    std::printf("%u keyframes\n", keyframes);
    if (keyframes < 3) return 1;
  }
  std::printf("%llu parts on a second thread\n",
              static_cast<unsigned long long>(workers.counts().parts_by_threads));
  return 0;
}
