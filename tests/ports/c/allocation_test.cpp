// Proof that the C interface allocates nothing, um_init included.
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <vector>

#include "c_pipeline.hpp"
#include "ports/linux/allocation_counter.hpp"

using namespace unimapper::test;
using unimapper::linux_port::AllocationGuard;

namespace {

/// Runs everything a robot would, refusals included; returns the keyframes.
unsigned run(void* memory, std::size_t bytes, const um_config& config,
             const std::vector<LabelledScan>& scans, std::vector<std::uint8_t>& labels,
             std::span<std::byte> scratch, std::vector<std::uint8_t>& buffer) {
  unsigned keyframes = 0;
  um_pipeline* pipeline = nullptr;
  if (um_init(&config, memory, bytes - 1, &pipeline, nullptr) == UM_OK) return 0;
  if (um_init(&config, memory, bytes, &pipeline, nullptr) != UM_OK) return 0;
  for (int round = 0; round < 2; ++round) {
    for (std::size_t i = 0; i < scans.size(); ++i) {
      const um_points points = points_of(scans[i]);
      const um_pose pose = pose_of(driving(static_cast<int>(i)));
      const auto stamp_ns = static_cast<std::int64_t>(i) + 1;
      std::int32_t ready = 0;
      if (um_add_scan(pipeline, nullptr, &pose, stamp_ns, &ready) == UM_OK) return 0;
      const bool first = i == 0;  // any stamp will do
      if ((um_add_scan(pipeline, &points, &pose, -1, &ready) == UM_OK) != first) return 0;
      if (um_add_scan(pipeline, &points, &pose, stamp_ns, &ready) != UM_OK) return 0;
      if (ready == 0) continue;
      um_keyframe keyframe;
      keyframe.struct_size = sizeof keyframe;
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
  void* const memory = std::aligned_alloc(UM_ALIGNMENT, bytes);
  std::vector<LabelledScan> scans;
  for (int i = 0; i < 25; ++i) {
    scans.push_back(scene_with_walker().scan(driving(i), 0.1 * i));
  }
  std::vector<std::uint8_t> labels(100000);
  std::vector<std::uint8_t> buffer(1U << 20U);
  // More than um_encode_scratch_bytes of this configuration.
  const std::size_t scratch_bytes = std::size_t{4} << 20U;
  auto* const scratch = static_cast<std::byte*>(std::aligned_alloc(UM_ALIGNMENT, scratch_bytes));
  unsigned keyframes = 0;
  {
    const AllocationGuard guard;
    keyframes = run(memory, bytes, config, scans, labels, {scratch, scratch_bytes}, buffer);
  }
  const std::uint64_t allocations = AllocationGuard::count() - before;
  std::printf("%llu allocations in %u keyframes\n", static_cast<unsigned long long>(allocations),
              keyframes);
  std::free(scratch);
  std::free(memory);
  return allocations == 0 && keyframes == 4 ? 0 : 1;
}
