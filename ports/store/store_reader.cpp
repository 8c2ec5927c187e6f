#include "ports/store/store_reader.hpp"

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include "ports/store/project_reader.hpp"
#include "ports/store/session_key.hpp"
#include "ports/store/store_file.hpp"
#include "ports/store/transaction.hpp"
#include "unimapper/wire/byte_io.hpp"
#include "unimapper/wire/keyframe_codec.hpp"
#include "unimapper/wire/receiver.hpp"

namespace unimapper::store {

StoredKeyframe keyframe_in(const Statement& rows) {
  StoredKeyframe keyframe;
  keyframe.sequence = static_cast<std::uint32_t>(rows.number(0));
  const auto bytes = rows.bytes(2);
  keyframe.bytes.assign(bytes.begin(), bytes.end());
  keyframe.is_sound = std::int64_t{wire::crc32(keyframe.bytes)} == rows.number(1);
  return keyframe;
}

StoreReader::StoreReader(const std::filesystem::path& folder)
    : database_(open_for_reading(folder)) {}

std::vector<SessionListing> StoreReader::sessions() {
  Statement rows(
      database_,
      "SELECT id, identity, name, sensor, ended, announced, dropped, keyframes, bytes, "
      "first_stored_s, "
      "(SELECT stamp_ns FROM keyframes WHERE session = id ORDER BY sequence LIMIT 1), "
      "(SELECT stamp_ns FROM keyframes WHERE session = id ORDER BY sequence DESC LIMIT 1), "
      "(SELECT COUNT(*) FROM health WHERE session = id), "
      "(SELECT COUNT(*) FROM summaries WHERE session = id) FROM sessions ORDER BY id");
  std::vector<SessionListing> sessions;
  std::set<std::string> taken;
  while (rows.step()) {
    SessionListing& session = sessions.emplace_back();
    session.row = rows.number(0);
    const std::optional<SessionId> id = from_key(rows.bytes(1));
    if (!id) {
      throw StoreError(database_.file().string() + ": session " + std::to_string(session.row) +
                       " has an identity that is none");
    }
    session.info = {*id, wire::name_of(*id), {}};
    if (!rows.is_null(2)) session.info = {*id, rows.text(2), rows.text(3)};
    session.ended = rows.number(4) != 0;
    session.announced = static_cast<std::uint64_t>(rows.number(5));
    session.dropped_by_sender = static_cast<std::uint64_t>(rows.number(6));
    session.keyframes = static_cast<std::uint64_t>(rows.number(7));
    session.bytes = static_cast<std::uint64_t>(rows.number(8));
    session.first_stored_s = rows.number(9);
    session.first_stamp_ns = rows.number(10);
    session.last_stamp_ns = rows.number(11);
    session.health_rows = static_cast<std::uint64_t>(rows.number(12));
    session.summaries = static_cast<std::uint64_t>(rows.number(13));
    const std::string name = session.info.name;
    for (int number = 2; !taken.insert(session.info.name).second; ++number) {
      session.info.name = name + "-" + std::to_string(number);
    }
    // Removed for good; the others keep their names.
    if (session.keyframes == 0 && session.summaries == 0) sessions.pop_back();
  }
  return sessions;
}

void StoreReader::for_each_keyframe(const SessionListing& session,
                                    const std::function<void(StoredKeyframe&&)>& take) {
  Statement rows(database_, std::string(kSelectKeyframes) + " WHERE session = ? ORDER BY sequence");
  rows.bind(session.row);
  while (rows.step()) take(keyframe_in(rows));
}

SessionData StoreReader::read(const SessionListing& session,
                              const std::function<void(KeyframeRecord&)>& each) {
  SessionData data;
  data.keyframes.reserve(session.keyframes);
  read_on(session, data, each);
  return data;
}

void StoreReader::read_on(const SessionListing& session, SessionData& data,
                          const std::function<void(KeyframeRecord&)>& each) {
  const Snapshot snapshot(database_);
  data.info = session.info;
  data.complete = session.ended;
  data.keyframes_missing = session.missing();
  data.keyframes_damaged = 0;
  std::set<std::uint32_t> known;
  for (const KeyframeRecord& keyframe : data.keyframes) known.insert(keyframe.sequence);
  Statement rows(database_, "SELECT sequence FROM keyframes WHERE session = ? ORDER BY sequence");
  rows.bind(session.row);
  while (rows.step()) {
    const auto sequence = static_cast<std::uint32_t>(rows.number(0));
    if (known.count(sequence) != 0) continue;
    if (!read_keyframe(session.row, sequence, data, each)) ++data.keyframes_damaged;
  }
  std::sort(data.keyframes.begin(), data.keyframes.end(),
            [](const auto& a, const auto& b) { return a.sequence < b.sequence; });
  data.summaries.clear();
  read_summaries(session, data);
}

/// False if it is damaged.
bool StoreReader::read_keyframe(std::int64_t session, std::uint32_t sequence, SessionData& data,
                                const std::function<void(KeyframeRecord&)>& each) {
  Statement row(database_, std::string(kSelectKeyframes) + " WHERE session = ? AND sequence = ?");
  row.bind(session, std::int64_t{sequence});
  wire::DecodedKeyframe decoded;
  if (row.step()) {
    const StoredKeyframe stored = keyframe_in(row);
    if (stored.is_sound) decoded = wire::decode_keyframe(stored.bytes);
  }
  if (!decoded.record) return false;
  if (each) each(*decoded.record);
  data.keyframes.push_back(std::move(*decoded.record));
  return true;
}

void StoreReader::read_summaries(const SessionListing& session, SessionData& data) {
  if (session.summaries == 0) return;
  Statement rows(database_,
                 "SELECT crc32, bytes FROM summaries WHERE session = ? ORDER BY sequence");
  rows.bind(session.row);
  while (rows.step()) {
    const wire::Bytes bytes = rows.bytes(1);
    wire::DecodedKeyframe decoded;
    if (std::int64_t{wire::crc32(bytes)} == rows.number(0)) decoded = wire::decode_summary(bytes);
    if (decoded.record) data.summaries.push_back(std::move(*decoded.record));
  }
}

std::vector<std::string> StoreReader::check() {
  const Snapshot snapshot(database_);
  std::vector<std::string> faults;
  Statement pages(database_, "PRAGMA integrity_check");
  while (pages.step()) {
    if (pages.text(0) != "ok") faults.push_back(pages.text(0));
  }
  for (const SessionListing& session : sessions()) {
    std::uint64_t keyframes = 0;
    std::uint64_t bytes = 0;
    for_each_keyframe(session, [&](StoredKeyframe&& keyframe) {
      ++keyframes;
      bytes += keyframe.bytes.size();
      if (!keyframe.is_sound) {
        faults.push_back("keyframe " + std::to_string(keyframe.sequence) + " of " +
                         session.info.name + " fails its checksum");
      }
    });
    if (keyframes != session.keyframes || bytes != session.bytes) {
      faults.push_back(session.info.name + " has " + std::to_string(keyframes) + " keyframes of " +
                       std::to_string(bytes) + " bytes, its row says " +
                       std::to_string(session.keyframes) + " of " + std::to_string(session.bytes));
    }
  }
  for (std::string& fault : ProjectReader(database_).check()) faults.push_back(std::move(fault));
  return faults;
}

}  // namespace unimapper::store
