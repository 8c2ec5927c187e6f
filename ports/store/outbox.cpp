#include "ports/store/outbox.hpp"

#include <string>
#include <utility>

#include "ports/store/session_key.hpp"
#include "ports/store/transaction.hpp"
#include "unimapper/wire/byte_io.hpp"

namespace unimapper::store {

namespace {

/// Of keyframe k.
constexpr const char* kNoMark =
    "NOT EXISTS (SELECT 1 FROM handed_on_keyframes h "
    "WHERE h.session = k.session AND h.sequence = k.sequence)";

}  // namespace

Outbox::Outbox(const std::filesystem::path& folder, const StoreLock& /*held*/)
    : reading_(open_for_reading(folder)), writing_(database_of(folder), Access::kWrite) {
  // The base's own commits sync the log that both write, and it moves the log to the database.
  writing_.run("PRAGMA synchronous = NORMAL; PRAGMA wal_autocheckpoint = 0");
  start_over();
}

bool Outbox::has_changed() {
  const std::int64_t version = reading_.number("PRAGMA data_version");
  return version != std::exchange(version_, version);
}

void Outbox::start_over() {
  damaged_ = 0;
  // The index alone has no keyframe's bytes to pass over.
  Statement first(reading_, std::string("SELECT MIN(k.rowid) FROM keyframes k INDEXED BY "
                                        "sqlite_autoindex_keyframes_1 WHERE ") +
                                kNoMark);
  returned_ = first.step() && !first.is_null(0)
                  ? first.number(0) - 1
                  : reading_.number("SELECT MAX(rowid) FROM keyframes");
}

std::vector<OutgoingKeyframe> Outbox::next(std::size_t most, std::size_t most_bytes) {
  // The join is written in the order in which it is to be done.
  Statement rows(reading_,
                 std::string("SELECT k.rowid, k.session, k.sequence, k.crc32, k.bytes, s.identity "
                             "FROM keyframes k CROSS JOIN sessions s ON s.id = k.session "
                             "WHERE k.rowid > ? AND ") +
                     kNoMark + " ORDER BY k.rowid");
  rows.bind(returned_);
  std::vector<OutgoingKeyframe> keyframes;
  std::size_t bytes = 0;
  while (keyframes.size() < most && bytes < most_bytes && rows.step()) {
    returned_ = rows.number(0);
    const wire::Bytes stored = rows.bytes(4);
    const auto id = from_key(rows.bytes(5));
    if (!id || std::int64_t{wire::crc32(stored)} != rows.number(3)) {
      ++damaged_;
      continue;
    }
    bytes += stored.size();
    keyframes.push_back({rows.number(1),
                         {*id, static_cast<std::uint32_t>(rows.number(2))},
                         {stored.begin(), stored.end()}});
  }
  return keyframes;
}

std::uint64_t Outbox::unmarked() {
  return static_cast<std::uint64_t>(
      reading_.number("SELECT (SELECT COALESCE(SUM(keyframes), 0) FROM sessions) - "
                      "(SELECT COUNT(*) FROM handed_on_keyframes)"));
}

std::vector<OutgoingSession> Outbox::sessions() {
  Statement rows(reading_,
                 "SELECT s.id, s.identity, s.name, s.sensor, s.ended, s.announced, s.dropped, "
                 "h.message FROM sessions s LEFT JOIN handed_on_sessions h ON h.session = s.id "
                 "WHERE s.keyframes > 0 AND s.name IS NOT NULL ORDER BY s.id");
  std::vector<OutgoingSession> sessions;
  while (rows.step()) {
    const auto id = from_key(rows.bytes(1));
    if (!id) continue;
    const wire::Bytes message = rows.bytes(7);
    sessions.push_back(
        {rows.number(0),
         {*id, SessionInfo{*id, rows.text(2), rows.text(3)}, rows.number(4) != 0,
          static_cast<std::uint64_t>(rows.number(5)), static_cast<std::uint64_t>(rows.number(6))},
         {message.begin(), message.end()}});
  }
  return sessions;
}

void Outbox::mark(const Marks& marks) {
  Transaction transaction(writing_);
  // A keyframe that was removed meanwhile may come again, and then has no mark.
  Statement keyframe(writing_,
                     "INSERT OR IGNORE INTO handed_on_keyframes (session, sequence) "
                     "SELECT session, sequence FROM keyframes WHERE session = ? AND sequence = ?");
  for (const OutgoingKeyframe& one : marks.keyframes) {
    keyframe.bind(one.session, std::int64_t{one.name.sequence}).run();
  }
  Statement session(writing_,
                    "INSERT OR REPLACE INTO handed_on_sessions (session, message) VALUES (?, ?)");
  for (const OutgoingSession& one : marks.sessions) session.bind(one.row, one.handed_over).run();
  transaction.commit();
}

void Outbox::forget_marks() {
  Transaction transaction(writing_);
  writing_.run("DELETE FROM handed_on_keyframes; DELETE FROM handed_on_sessions");
  transaction.commit();
  start_over();
}

}  // namespace unimapper::store
