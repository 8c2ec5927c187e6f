// Proof that running takes no page fault: `Pipeline::create` touches all of its memory.
#include <sys/resource.h>

#include <atomic>
#include <cstdio>
#include <vector>

#include "tests/proof/runs.hpp"
#include "tests/proof/watched_workers.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::test;

long page_faults() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_minflt + usage.ru_majflt;
}

/// Counts the page faults of a part on a worker thread.
struct CountedPart {
  static inline std::atomic<long> faults = 0;
  long before = page_faults();
  ~CountedPart() { faults += page_faults() - before; }
};

/// The counter must see a fault when there is one: an untouched block of many pages.
bool counter_works() {
  constexpr std::size_t kPages = 1000;
  constexpr std::size_t kPageBytes = 4096;
  auto* const fresh =
      static_cast<volatile char*>(std::aligned_alloc(kPageBytes, kPages * kPageBytes));
  const long before = page_faults();
  for (std::size_t i = 0; i < kPages; ++i) fresh[i * kPageBytes] = 1;
  const long faults = page_faults() - before;
  std::free(const_cast<char*>(fresh));
  std::printf("%ld faults in %zu fresh pages\n", faults, kPages);
  return faults > 0;
}

/// A stack as deep as the pipeline may need, touched once.
[[gnu::noinline]] void prefault_stack() {
  volatile char stack[65536];
  for (std::size_t i = 0; i < sizeof stack; i += 1024) stack[i] = 1;
}

/// Whether no keyframe but the first takes a fault.
bool runs_without(const PipelineConfig& config, const std::vector<LabelledScan>& scans) {
  OwnedPipeline pipeline(config);
  std::vector<PointLabel> labels(100000, PointLabel::kUnknown);
  prefault_stack();
  // The code's own pages come in with the first keyframe.
  unsigned keyframes = 0;
  long before = 0;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const ScanResult result =
        pipeline->add_scan(scans[i].view(), sensor_at(0, 0), static_cast<std::int64_t>(i));
    if (!result.keyframe_ready) continue;
    read_labels(pipeline, labels);
    if (++keyframes == 1) before = page_faults() + CountedPart::faults;
  }
  const long faults = page_faults() + CountedPart::faults - before;
  std::printf("%ld page faults in %u keyframes after the first\n", faults, keyframes - 1);
  return faults == 0 && keyframes == 5;
}

}  // namespace

int main() {
  if (!counter_works()) return 1;
  const std::vector<LabelledScan> scans = scans_of_street(50);
  PipelineConfig config = small_config();
  if (!runs_without(config, scans)) return 1;
  WatchedWorkers<CountedPart> workers(2);
  config.executor = workers.executor();
  if (!runs_without(config, scans)) return 1;
  std::printf("%llu parts on a second thread\n",
              static_cast<unsigned long long>(workers.counts().parts_by_threads));
}
