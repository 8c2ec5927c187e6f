#include "ports/store/session_import.hpp"

#include <chrono>

#include "ports/store/session_key.hpp"
#include "unimapper/wire/byte_io.hpp"

namespace unimapper::store {

SessionImport::SessionImport(Database& database)
    : database_(database),
      now_s_(std::chrono::duration_cast<std::chrono::seconds>(
                 std::chrono::system_clock::now().time_since_epoch())
                 .count()) {}

/// Does it unless something went wrong before.
template <typename Step>
void SessionImport::attempt(const Step& step) {
  if (!trouble_.empty()) return;
  try {
    step();
  } catch (const StoreError& error) {
    trouble_ = error.what();
  }
}

wire::KeyframeStorage::Taken SessionImport::keep(wire::ReceivedKeyframe&& keyframe) {
  attempt([&] { write(keyframe); });
  return trouble_.empty() ? Taken::kStored : Taken::kNoRoom;
}

// It goes to the store if its keyframe is not whole at the end.
void SessionImport::keep(wire::ReceivedSummary&& summary) {
  attempt([&] { (void)session_of(summary.record.session); });
  summaries_[{summary.record.session, summary.record.sequence}] = std::move(summary);
}

void SessionImport::remove_summary(const wire::KeyframeName& name) { summaries_.erase(name); }

void SessionImport::keep(const wire::SessionSummary& summary) {
  attempt([&] { write(summary); });
}

wire::Committed SessionImport::commit_all(std::int64_t) {
  for (const auto& waiting : summaries_) {
    attempt([&] { write(waiting.second); });
  }
  summaries_.clear();
  return {};
}

/// Nothing is known: what is stored already is compared with what arrives.
std::optional<wire::StoredSession> SessionImport::find(const SessionId& id) {
  wire::StoredSession session;
  session.summary.id = id;
  return session;
}

std::int64_t SessionImport::row_of(const SessionId& id) {
  const std::vector<std::uint8_t> key = to_key(id);
  Statement(database_,
            "INSERT INTO sessions (identity, robot, first_stored_s) VALUES (?, ?, ?) "
            "ON CONFLICT DO NOTHING")
      .bind(key, std::int64_t{id.robot}, now_s_)
      .run();
  Statement row(database_, "SELECT id FROM sessions WHERE identity = ?");
  row.bind(key);
  return row.step() ? row.number(0) : 0;
}

ImportedSession& SessionImport::session_of(const SessionId& id) {
  ImportedSession& session = sessions_[id];
  if (session.row == 0) session.row = row_of(id);
  return session;
}

void SessionImport::write(const wire::ReceivedSummary& summary) {
  const KeyframeRecord& record = summary.record;
  Statement(database_,
            "INSERT INTO summaries (session, sequence, stamp_ns, crc32, bytes) "
            "SELECT ?1, ?2, ?3, ?4, ?5 WHERE NOT EXISTS "
            "(SELECT 1 FROM keyframes WHERE session = ?1 AND sequence = ?2) ON CONFLICT DO NOTHING")
      .bind(session_of(record.session).row, std::int64_t{record.sequence},
            record.scans.back().stamp_ns, std::int64_t{wire::crc32(summary.bytes)}, summary.bytes)
      .run();
}

void SessionImport::write(const wire::ReceivedKeyframe& keyframe) {
  ImportedSession& session = session_of(keyframe.record.session);
  summaries_.erase({keyframe.record.session, keyframe.record.sequence});
  const std::int64_t sequence{keyframe.record.sequence};
  const std::int64_t checksum{wire::crc32(keyframe.bytes)};
  Statement insert(database_,
                   "INSERT INTO keyframes (session, sequence, stamp_ns, crc32, bytes) "
                   "VALUES (?, ?, ?, ?, ?) ON CONFLICT DO NOTHING");
  insert.bind(session.row, sequence, keyframe.record.scans.back().stamp_ns, checksum,
              keyframe.bytes);
  insert.run();
  if (database_.changes() == 0) return compare(keyframe, checksum, session);
  ++session.keyframes;
  Statement(database_,
            "UPDATE sessions SET keyframes = keyframes + 1, bytes = bytes + ? WHERE id = ?")
      .bind(to_integer(keyframe.bytes.size()), session.row)
      .run();
  Statement(database_, "DELETE FROM summaries WHERE session = ? AND sequence = ?")
      .bind(session.row, sequence)
      .run();
}

/// Compares a keyframe with the stored one of its number, which it replaces if that one is damaged.
void SessionImport::compare(const wire::ReceivedKeyframe& keyframe, std::int64_t checksum,
                            ImportedSession& session) {
  const std::int64_t sequence{keyframe.record.sequence};
  Statement stored(database_,
                   "SELECT crc32, bytes FROM keyframes WHERE session = ? AND sequence = ?");
  stored.bind(session.row, sequence);
  if (!stored.step()) return;
  const std::span<const std::uint8_t> bytes = stored.bytes(1);
  if (std::int64_t{wire::crc32(bytes)} == stored.number(0)) {
    ++(checksum == stored.number(0) ? session.repeated : session.differing);
    return;
  }
  Statement(database_,
            "UPDATE keyframes SET crc32 = ?, bytes = ?, stamp_ns = ? WHERE session = ? AND "
            "sequence = ?")
      .bind(checksum, keyframe.bytes, keyframe.record.scans.back().stamp_ns, session.row, sequence)
      .run();
  Statement(database_,
            "UPDATE sessions SET bytes = (SELECT sum(length(bytes)) FROM keyframes WHERE session = "
            "id) WHERE id = ?")
      .bind(session.row)
      .run();
  ++session.replaced;
}

void SessionImport::write(const wire::SessionSummary& summary) {
  const auto found = sessions_.find(summary.id);
  if (found == sessions_.end()) return;
  const std::int64_t row = found->second.row;
  Statement(database_,
            "UPDATE sessions SET ended = max(ended, ?), announced = max(announced, ?), "
            "dropped = max(dropped, ?) WHERE id = ?")
      .bind(std::int64_t{summary.ended ? 1 : 0}, to_integer(summary.announced),
            to_integer(summary.dropped_by_sender), row)
      .run();
  if (!summary.info) return;
  found->second.name = summary.info->name;
  Statement(database_,
            "UPDATE sessions SET name = coalesce(name, ?), sensor = coalesce(sensor, ?) "
            "WHERE id = ?")
      .bind(summary.info->name, summary.info->sensor, row)
      .run();
}

void SessionImport::name(const SessionId& id, const std::string& name) {
  const auto found = sessions_.find(id);
  if (found == sessions_.end()) return;
  found->second.name = name;
  const ImportedSession& session = found->second;
  if (session.repeated + session.replaced + session.differing > 0) return;
  Statement(database_, "UPDATE sessions SET name = ? WHERE id = ?")
      .bind(name, found->second.row)
      .run();
}

}  // namespace unimapper::store
