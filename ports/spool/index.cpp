#include "ports/spool/index.hpp"

#include <algorithm>
#include <limits>
#include <system_error>

namespace unimapper::spool {

namespace fs = std::filesystem;

namespace {

/// What a file of so many bytes takes on disk at least.
std::uint64_t disk_space(std::uint64_t bytes) {
  constexpr std::uint64_t kBlock = 4096;
  return (bytes + kBlock - 1) / kBlock * kBlock;
}

}  // namespace

Found Index::read(const fs::path& folder) {
  std::map<std::uint64_t, fs::path> files;
  std::error_code ignored;
  for (fs::directory_iterator entry(folder, ignored); entry != fs::directory_iterator();
       entry.increment(ignored)) {
    if (const auto number = segment_number(entry->path().filename().string())) {
      files[*number] = entry->path();
    }
    if (ignored) break;
  }
  Found found;
  for (const auto& [number, file] : files) read_segment(file, number, found);
  return found;
}

void Index::read_segment(const fs::path& file, std::uint64_t number, Found& found) {
  last_segment_ = std::max(last_segment_, number);
  SegmentReader reader(file);
  if (!reader.ok()) {
    ++found.segments_skipped;
    return;
  }
  segments_[number].bytes = reader.bytes();
  Record record;
  while (reader.next(record)) {
    switch (record.kind) {
      case RecordKind::kKeyframe:
        add(record.info, record.sequence,
            {number, record.data_offset, record.data_bytes, record.data_crc32, record.stamp_ns},
            record.written_s);
        break;
      case RecordKind::kAcknowledged:
        for (const auto& range : record.acknowledged) acknowledge(record.info.id, range);
        break;
      case RecordKind::kEnded:
        end(record.info.id);
        break;
    }
  }
  found.faults += reader.faults();
}

void Index::take_acknowledgements(const Index& other) {
  for (const auto& [id, session] : other.sessions_) {
    const auto own = sessions_.find(id);
    if (own == sessions_.end()) continue;
    for (const auto& range : session.acknowledged.ranges()) acknowledge(id, range);
    own->second.ended = own->second.ended || session.ended;
  }
}

std::uint64_t Index::begin_segment() {
  segments_[++last_segment_].bytes = kSegmentHeadBytes;
  return last_segment_;
}

void Index::set_bytes(std::uint64_t segment, std::uint64_t bytes) {
  segments_[segment].bytes = bytes;
}

void Index::add(const SessionInfo& info, std::uint32_t sequence, const Place& place,
                std::int64_t written_s) {
  IndexedSession& session = sessions_[info.id];
  session.info = info;
  const auto before = session.on_disk.find(sequence);
  if (before != session.on_disk.end()) take_from_disk(session, before);
  session.on_disk[sequence] = place;
  if (!session.acknowledged.contains(sequence)) waiting_bytes_ += place.bytes;
  Segment& segment = segments_[place.segment];
  segment.keyframes.push_back({info.id, sequence});
  segment.newest_s = std::max(segment.newest_s, written_s);
}

void Index::acknowledge(const SessionId& session, wire::SequenceRange range) {
  IndexedSession& entry = sessions_[session];
  entry.info.id = session;
  // Sequences have 32 bits, ranges of what a base says 64.
  if (range.begin > std::numeric_limits<std::uint32_t>::max()) return;
  auto place = entry.on_disk.lower_bound(static_cast<std::uint32_t>(range.begin));
  for (; place != entry.on_disk.end() && place->first < range.end; ++place) {
    if (!entry.acknowledged.contains(place->first)) waiting_bytes_ -= place->second.bytes;
  }
  entry.acknowledged.insert(range);
}

void Index::end(const SessionId& session) {
  IndexedSession& entry = sessions_[session];
  entry.info.id = session;
  entry.ended = true;
}

Removed Index::remove_segment(std::uint64_t segment) {
  Removed removed;
  const auto node = segments_.extract(segment);
  if (node.empty()) return removed;
  for (const Key& key : node.mapped().keyframes) {
    const auto session = sessions_.find(key.session);
    if (session == sessions_.end()) continue;
    const auto place = session->second.on_disk.find(key.sequence);
    // It may have been written again, to a later segment.
    if (place == session->second.on_disk.end() || place->second.segment != segment) continue;
    take_from_disk(session->second, place);
    ++(session->second.acknowledged.contains(key.sequence) ? removed.acknowledged
                                                           : removed.waiting);
  }
  return removed;
}

void Index::remove_keyframe(const SessionId& session, std::uint32_t sequence) {
  const auto entry = sessions_.find(session);
  if (entry == sessions_.end()) return;
  const auto place = entry->second.on_disk.find(sequence);
  if (place != entry->second.on_disk.end()) take_from_disk(entry->second, place);
}

void Index::take_from_disk(IndexedSession& session,
                           std::map<std::uint32_t, Place>::iterator place) {
  if (!session.acknowledged.contains(place->first)) waiting_bytes_ -= place->second.bytes;
  session.on_disk.erase(place);
}

void Index::forget_if_empty(const SessionId& session) {
  const auto entry = sessions_.find(session);
  if (entry != sessions_.end() && entry->second.on_disk.empty()) sessions_.erase(entry);
}

std::optional<Place> Index::find(const SessionId& session, std::uint32_t sequence) const {
  const auto entry = sessions_.find(session);
  if (entry == sessions_.end()) return std::nullopt;
  const auto place = entry->second.on_disk.find(sequence);
  return place == entry->second.on_disk.end() ? std::nullopt : std::optional(place->second);
}

bool Index::is_acknowledged(std::uint64_t number, const Segment& segment) const {
  return std::all_of(segment.keyframes.begin(), segment.keyframes.end(), [&](const Key& key) {
    const auto place = find(key.session, key.sequence);
    return !place || place->segment != number ||
           sessions_.at(key.session).acknowledged.contains(key.sequence);
  });
}

std::optional<std::uint64_t> Index::oldest_acknowledged(std::uint64_t current) const {
  for (const auto& [number, segment] : segments_) {
    if (number != current && is_acknowledged(number, segment)) return number;
  }
  return std::nullopt;
}

std::optional<std::uint64_t> Index::oldest(std::uint64_t current) const {
  for (const auto& [number, segment] : segments_) {
    if (number != current) return number;
  }
  return std::nullopt;
}

std::optional<std::uint64_t> Index::older_than(std::int64_t second, std::uint64_t current) const {
  for (const auto& [number, segment] : segments_) {
    if (number != current && segment.newest_s < second) return number;
  }
  return std::nullopt;
}

std::uint64_t Index::bytes() const {
  std::uint64_t sum = 0;
  for (const auto& [number, segment] : segments_) sum += disk_space(segment.bytes);
  return sum;
}

std::uint64_t Index::keyframes() const {
  std::uint64_t sum = 0;
  for (const auto& [id, session] : sessions_) sum += session.on_disk.size();
  return sum;
}

}  // namespace unimapper::spool
