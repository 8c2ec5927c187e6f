// Keyframes that are read on demand, under a limit of bytes.
#include "keyframe_cache.hpp"

#include <utility>
#include <vector>

#include "src/merge/limited_cache.hpp"
#include "unimapper/merge/keyframe_level.hpp"

namespace unimapper::merge {

class KeyframeCache::State {
 public:
  using Key = std::pair<std::uint32_t, std::uint32_t>;  // session, sequence
  explicit State(std::uint64_t max_bytes) : cache(max_bytes) {}
  LimitedCache<Key, KeyframeRecord> cache;
};

class KeyframeCache::OfSession final : public ReadContents {
 public:
  OfSession(std::shared_ptr<State> state, std::uint32_t session, ReadKeyframe read)
      : state_(std::move(state)), session_(session), read_(std::move(read)) {}

  [[nodiscard]] std::shared_ptr<const KeyframeRecord> whole(
      const KeyframeRecord& light) const override {
    auto found = state_->cache.get(
        {session_, light.sequence}, [&](const State::Key&) { return read_like(light); }, bytes_of);
    if (found->T_odometry_keyframe.rotation == light.T_odometry_keyframe.rotation) return found;
    return std::make_shared<const KeyframeRecord>(read_like(light));
  }

  void offer(KeyframeRecord whole) override {
    const State::Key key{session_, whole.sequence};
    const std::uint64_t bytes = bytes_of(whole);
    state_->cache.offer(key, std::make_shared<const KeyframeRecord>(std::move(whole)), bytes);
  }

 private:
  /// As the light one is since it was levelled.
  [[nodiscard]] KeyframeRecord read_like(const KeyframeRecord& light) const {
    KeyframeRecord whole = read_(light.sequence);
    if (whole.T_odometry_keyframe.rotation == light.T_odometry_keyframe.rotation) return whole;
    turn_keyframe(whole, light.T_odometry_keyframe);
    whole.up = light.up;
    whole.keypoints = light.keypoints;
    whole.planes = light.planes;
    return whole;
  }

  std::shared_ptr<State> state_;
  std::uint32_t session_;
  ReadKeyframe read_;
};

KeyframeCache::KeyframeCache(std::uint64_t max_bytes)
    : state_(std::make_shared<State>(max_bytes)) {}

std::shared_ptr<ReadContents> KeyframeCache::contents(ReadKeyframe read) {
  return std::make_shared<OfSession>(state_, sessions_++, std::move(read));
}

void drop_contents(KeyframeRecord& keyframe) {
  // Clearing would keep their memory.
  keyframe.static_cells = std::vector<FineCell>();
  keyframe.dynamic_cells = std::vector<FineCell>();
  keyframe.images = std::vector<CodedImage>();
}

std::uint64_t bytes_of(const KeyframeRecord& keyframe) {
  std::uint64_t bytes = sizeof keyframe + keyframe.scans.size() * sizeof(KeyframeScan) +
                        keyframe.keypoints.size() * sizeof(Keypoint) +
                        keyframe.planes.size() * sizeof(PlanePatch);
  bytes +=
      (keyframe.static_cells.capacity() + keyframe.dynamic_cells.capacity()) * sizeof(FineCell);
  for (const CodedImage& image : keyframe.images) bytes += sizeof image + image.code.capacity();
  return bytes;
}

}  // namespace unimapper::merge
