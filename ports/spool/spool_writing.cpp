// Writing of a spool's segments, on its own thread.
#include <algorithm>
#include <cerrno>
#include <system_error>

#include "ports/spool/spool.hpp"

namespace unimapper::spool {

namespace {

std::int64_t seconds_of_clock() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::seconds>(now).count();
}

}  // namespace

bool Spool::write(const Batch& batch) {
  try {
    if (!prepared_) prepare();
  } catch (const std::system_error& error) {
    fail(error.code().value());
    return false;
  }
  while (true) {
    bool ok = true;
    for (const ItemPointer& item : batch.keyframes) ok = ok && write_keyframe(item);
    ok = ok && (writer_.is_open() || begin_segment(0)) &&
         write_acknowledgements(batch.acknowledged, batch.ended) && sync_beside_writing();
    if (ok) break;
    const int error = errno;
    placed_.clear();
    abandon_segment();
    if (error == ENOSPC && make_room_on_full_disk()) continue;
    fail(error);
    return false;
  }
  succeed();
  return true;
}

bool Spool::write_keyframe(const ItemPointer& item) {
  if (is_placed(item)) return true;                          // beside the sync before
  if (is_durable(item->info.id, item->keyframe.sequence)) {  // by an earlier attempt
    const std::lock_guard lock(mutex_);
    take_off_queue(item);
    return true;
  }
  const std::vector<std::uint8_t>& bytes = item->keyframe.bytes;
  const bool full = writer_.is_open() && writer_.bytes() + bytes.size() > options_.segment_bytes;
  if (full && !sync_placed()) return false;
  if ((full || !writer_.is_open()) && !begin_segment(bytes.size())) return false;
  const std::int64_t written_s = seconds_of_clock();
  const std::vector<std::uint8_t> head = keyframe_head(item->info, item->keyframe, written_s);
  if (!writer_.append(head)) return false;
  const std::uint64_t offset = writer_.bytes();
  if (!writer_.append(bytes)) return false;
  // The checksum over the data stands in the fifth field of the head.
  wire::BigEndianReader reader(wire::Bytes(head).subspan(16));
  placed_.push_back({item,
                     {writer_.number(), offset, static_cast<std::uint32_t>(bytes.size()),
                      reader.get<std::uint32_t>(), item->keyframe.stamp_ns},
                     written_s});
  return true;
}

bool Spool::write_acknowledgements(const std::map<SessionId, SequenceSet>& acknowledged,
                                   const std::set<SessionId>& ended) {
  for (const auto& [session, sequences] : acknowledged) {
    if (sequences.empty()) continue;
    if (!writer_.append(acknowledged_record(session, sequences.ranges()))) return false;
  }
  return std::all_of(ended.begin(), ended.end(), [this](const SessionId& session) {
    return writer_.append(ended_record(session));
  });
}

/// A new segment, which repeats what is acknowledged: so any older one may go.
bool Spool::begin_segment(std::uint64_t keyframe_bytes) {
  writer_.close();
  make_room(std::max(options_.segment_bytes, keyframe_bytes + kSegmentOverheadBytes));
  std::uint64_t number = 0;
  std::map<SessionId, SequenceSet> acknowledged;
  std::set<SessionId> ended;
  {
    const std::lock_guard lock(mutex_);
    number = index_.begin_segment();
    for (const auto& [id, session] : index_.sessions()) {
      acknowledged[id] = session.acknowledged;
      if (session.ended) ended.insert(id);
    }
  }
  return writer_.begin(number) && write_acknowledgements(acknowledged, ended);
}

void Spool::take_off_queue(const ItemPointer& item) {
  const auto queued = std::find(queue_.begin(), queue_.end(), item);
  if (queued == queue_.end()) return;
  queue_bytes_ -= item->keyframe.bytes.size();
  queue_.erase(queued);
  --writing_;
}

/// What a failed write or sync left of the segment is unknown: the next record goes to a new one.
void Spool::abandon_segment() {
  if (!writer_.is_open()) return;
  const bool is_empty = writer_.synced_bytes() == 0;
  writer_.abandon();
  if (!is_empty) return;
  const std::lock_guard lock(mutex_);
  remove_segment(writer_.number());
}

void Spool::make_room(std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  const std::uint64_t current = 0;  // the one before is closed, and the next not begun
  if (options_.max_age.count() > 0) {
    const std::int64_t limit = seconds_of_clock() - options_.max_age.count();
    while (const auto old = index_.older_than(limit, current)) remove_segment(*old);
  }
  while (index_.bytes() + bytes > options_.bytes) {
    auto oldest = index_.oldest_acknowledged(current);
    if (!oldest) oldest = index_.oldest(current);
    if (!oldest) return;
    remove_segment(*oldest);
  }
}

bool Spool::make_room_on_full_disk() {
  const std::lock_guard lock(mutex_);
  const auto oldest = index_.oldest_acknowledged(0);
  if (oldest) remove_segment(*oldest);
  return oldest.has_value();
}

void Spool::remove_segment(std::uint64_t number) {
  (void)files_->remove(folder_ / segment_name(number));
  counters_.keyframes_lost += index_.remove_segment(number).waiting;
  std::vector<SessionId> empty;
  for (const auto& [id, session] : index_.sessions()) {
    if (session.on_disk.empty() && !own_.contains(id)) empty.push_back(id);
  }
  for (const SessionId& id : empty) index_.forget_if_empty(id);
}

}  // namespace unimapper::spool
