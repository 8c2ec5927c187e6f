// Proof that the C interface allocates nothing, um_init included.
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <vector>

#include "c_pipeline.hpp"
#include "ports/linux/allocation_counter.hpp"

using namespace unimapper;
using namespace unimapper::test;
using unimapper::linux_port::AllocationGuard;

namespace {

/// Runs everything a robot would, refusals included; returns the keyframes.
unsigned run(void* memory, std::size_t bytes, const um_config& config,
             std::vector<std::uint8_t>& labels, std::span<std::byte> scratch,
             std::vector<std::uint8_t>& buffer) {
  unsigned keyframes = 0;
  um_pipeline* pipeline = nullptr;
  if (um_init(&config, memory, bytes - 1, &pipeline, nullptr) == UM_OK) return 0;
  if (um_init(&config, memory, bytes, &pipeline, nullptr) != UM_OK) return 0;
  for (int round = 0; round < 2; ++round) {
    for (int i = 0; i < 25; ++i) {
      const um_points points = points_of(walker_scan(i));
      const um_pose pose = pose_of(driving(i));
      std::int32_t ready = 0;
      if (um_add_scan(pipeline, nullptr, &pose, 1 + i, &ready) == UM_OK) return 0;
      const bool first = i == 0;  // any stamp will do
      if ((um_add_scan(pipeline, &points, &pose, -1, &ready) == UM_OK) != first) return 0;
      if (um_add_scan(pipeline, &points, &pose, 1 + i, &ready) != UM_OK) return 0;
      if (ready == 0) continue;
      um_keyframe keyframe;
      std::size_t written = 0;
      if (um_keyframe_get(pipeline, &keyframe) != UM_OK) return 0;
      for (std::uint32_t s = 0; s < keyframe.scan_count; ++s) {
        if (um_labels(pipeline, s, labels.data(), labels.size(), &written) != UM_OK) return 0;
      }
      um_encoded encoded;
      const um_session session{1, 0, 0, 2};
      if (um_keyframe_encode(pipeline, &session, scratch.data(), scratch.size(), buffer.data(),
                             buffer.size(), &encoded) != UM_OK) {
        return 0;
      }
      ++keyframes;
    }
    if (um_flush(pipeline, nullptr) != UM_OK || um_reset(pipeline) != UM_OK) return 0;
  }
  return keyframes;
}

}  // namespace

int main() {
  {
    const AllocationGuard guard;
    void* volatile block = std::malloc(10);  // volatile: or it would be left out
    std::free(block);
    int* volatile number = new int(3);
    delete number;
  }
  const std::uint64_t before = AllocationGuard::count();
  if (before != 2) {
    std::puts("the counter itself does not count");
    return 1;
  }
  const um_config config = small_c_config();
  const std::size_t bytes = um_required_bytes(&config);
  const MemoryBlock memory(bytes);
  const MemoryBlock scratch(std::size_t{4} << 20U);  // more than um_encode_scratch_bytes
  std::vector<std::uint8_t> labels(100000);
  std::vector<std::uint8_t> buffer(1U << 20U);
  (void)walker_scan(0);  // makes them all
  unsigned keyframes = 0;
  {
    const AllocationGuard guard;
    keyframes = run(memory.data(), bytes, config, labels, scratch.span(), buffer);
  }
  const std::uint64_t allocations = AllocationGuard::count() - before;
  std::printf("%llu allocations in %u keyframes\n", static_cast<unsigned long long>(allocations),
              keyframes);
  return allocations == 0 && keyframes == 4 ? 0 : 1;
}
