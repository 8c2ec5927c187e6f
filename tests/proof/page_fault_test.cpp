// Proof that running takes no page fault: `Pipeline::create` touches all of its memory.
#include <sys/resource.h>

#include <cstdio>
#include <vector>

#include "tests/proof/runs.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::test;

long page_faults() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_minflt + usage.ru_majflt;
}

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

}  // namespace

int main() {
  if (!counter_works()) return 1;

  const std::vector<LabelledScan> scans = scans_of_street(50);
  OwnedPipeline pipeline(small_config());
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
    if (++keyframes == 1) before = page_faults();
  }
  const long faults = page_faults() - before;
  std::printf("%ld page faults in %u keyframes after the first\n", faults, keyframes - 1);
  return faults == 0 && keyframes == 5 ? 0 : 1;
}
