#include "unimapper/wire/memory_storage.hpp"

#include <utility>

namespace unimapper::wire {

namespace {

std::uint64_t memory_of(const KeyframeRecord& record) {
  std::uint64_t image_bytes = 0;
  for (const CodedImage& image : record.images) image_bytes += sizeof image + image.code.size();
  return sizeof record + record.scans.size() * sizeof(KeyframeScan) +
         (record.static_cells.size() + record.dynamic_cells.size()) * sizeof(FineCell) +
         record.keypoints.size() * sizeof(Keypoint) + record.planes.size() * sizeof(PlanePatch) +
         image_bytes;
}

}  // namespace

KeyframeStorage::Taken MemoryStorage::keep(ReceivedKeyframe&& keyframe) {
  const std::uint64_t bytes = memory_of(keyframe.record);
  if (bytes > max_bytes_ - bytes_) return Taken::kNoRoom;
  bytes_ += bytes;
  const std::uint32_t sequence = keyframe.record.sequence;
  sessions_[keyframe.record.session].emplace(sequence, std::move(keyframe.record));
  return Taken::kStored;
}

std::optional<StoredSession> MemoryStorage::find(const SessionId& id) {
  StoredSession none;
  none.summary.id = id;
  return none;
}

std::vector<KeyframeRecord> MemoryStorage::take(const SessionId& id) {
  std::vector<KeyframeRecord> keyframes;
  const auto session = sessions_.find(id);
  if (session == sessions_.end()) return keyframes;
  keyframes.reserve(session->second.size());
  for (auto& [sequence, record] : session->second) {
    bytes_ -= memory_of(record);
    keyframes.push_back(std::move(record));
  }
  sessions_.erase(session);
  return keyframes;
}

}  // namespace unimapper::wire
