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
  remove_summary({keyframe.record.session, keyframe.record.sequence});
  bytes_ += bytes;
  const std::uint32_t sequence = keyframe.record.sequence;
  keyframes_[keyframe.record.session].emplace(sequence, std::move(keyframe.record));
  return Taken::kStored;
}

void MemoryStorage::keep(ReceivedSummary&& summary) {
  const std::uint64_t bytes = memory_of(summary.record);
  if (bytes > max_bytes_ - bytes_) return;
  const std::uint32_t sequence = summary.record.sequence;
  auto& summaries = summaries_[summary.record.session];
  if (summaries.emplace(sequence, std::move(summary.record)).second) bytes_ += bytes;
}

void MemoryStorage::remove_summary(const KeyframeName& name) {
  const auto session = summaries_.find(name.session);
  if (session == summaries_.end()) return;
  const auto entry = session->second.find(name.sequence);
  if (entry == session->second.end()) return;
  bytes_ -= memory_of(entry->second);
  session->second.erase(entry);
}

std::optional<StoredSession> MemoryStorage::find(const SessionId& id) {
  StoredSession none;
  none.summary.id = id;
  return none;
}

std::vector<KeyframeRecord> MemoryStorage::take(Records& records, const SessionId& id) {
  std::vector<KeyframeRecord> taken;
  const auto session = records.find(id);
  if (session == records.end()) return taken;
  taken.reserve(session->second.size());
  for (auto& [sequence, record] : session->second) {
    bytes_ -= memory_of(record);
    taken.push_back(std::move(record));
  }
  records.erase(session);
  return taken;
}

void MemoryStorage::take(SessionData& session) {
  session.keyframes = take(keyframes_, session.info.id);
  session.summaries = take(summaries_, session.info.id);
}

}  // namespace unimapper::wire
