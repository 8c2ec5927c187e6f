// Fuzz target of messages in shared memory: what is accepted lies within its bytes.
//
// The input's first bytes say what is changed in a whole keyframe; random bytes alone would be
// refused at the head.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "ports/shared_memory/content_writer.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/ports/shared_memory/content_walk.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::shared_memory;
using fuzz::require;

std::vector<std::byte> whole_keyframe() {
  const std::array<KeyframeScan, 2> scans{};
  const std::array<FineCell, 9> cells{};
  const std::array<Keypoint, 3> keypoints{};
  const std::array<PlanePatch, 2> planes{};
  const std::array<LoopCandidate, 1> loops{};
  KeyframeView keyframe;
  keyframe.scans = scans;
  keyframe.static_cells = cells;
  keyframe.dynamic_cells = std::span(cells).first(4);
  keyframe.place.keypoints = keypoints;
  keyframe.place.planes = planes;
  keyframe.loops = loops;
  std::vector<std::byte> message(4096);
  message.resize(write_keyframe(keyframe, {7, 1}, message));
  return message;
}

void check(const std::vector<std::byte>& message) {
  if (const auto keyframe = read_keyframe(message)) require(test::walk(*keyframe, message));
  if (const auto labels = read_labels(message)) {
    require(test::is_inside(labels->fixed.labels, labels->labels, message.size()));
  }
  require(!read_health(message) || message.size() >= sizeof(SharedHealth));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<std::byte> whole = whole_keyframe();
  require(read_keyframe(whole).has_value());
  const auto* bytes = reinterpret_cast<const std::byte*>(data);
  check({bytes, bytes + size});
  // Each change: two bytes of offset and a word; some offsets cut the message there.
  std::vector<std::byte> changed = whole;
  for (std::size_t at = 0; at + 6 <= size; at += 6) {
    std::uint16_t offset = 0;
    std::memcpy(&offset, data + at, sizeof offset);
    if (offset % 8 == 7) changed.resize(std::min<std::size_t>(offset, changed.size()));
    if (offset + std::size_t{4} <= changed.size()) {
      std::memcpy(changed.data() + offset, data + at + 2, 4);
    }
  }
  check({changed.begin(), changed.end()});
  return 0;
}
