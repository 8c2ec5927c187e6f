#include "ports/store/session_follower.hpp"

#include <utility>

#include "ports/store/session_key.hpp"
#include "ports/store/store_file.hpp"
#include "unimapper/wire/receiver.hpp"

namespace unimapper::store {

SessionFollower::SessionFollower(const std::filesystem::path& folder)
    : database_(open_for_reading(folder)) {}

bool SessionFollower::has_changed() {
  const std::int64_t version = database_.number("PRAGMA data_version");
  return version != std::exchange(version_, version);
}

std::vector<SessionExtent> SessionFollower::sessions() {
  Statement rows(database_,
                 "SELECT id, identity, name, ended, keyframes, "
                 "(SELECT MAX(sequence) FROM keyframes WHERE session = id) "
                 "FROM sessions WHERE keyframes > 0 ORDER BY id");
  std::vector<SessionExtent> sessions;
  while (rows.step()) {
    const auto id = from_key(rows.bytes(1));
    if (!id) continue;  // `StoreReader::sessions` says so
    SessionExtent& session = sessions.emplace_back();
    session.row = rows.number(0);
    session.id = *id;
    session.name = rows.is_null(2) ? wire::name_of(*id) : rows.text(2);
    session.ended = rows.number(3) != 0;
    session.keyframes = static_cast<std::uint64_t>(rows.number(4));
    session.newest = rows.is_null(5) ? -1 : rows.number(5);
  }
  return sessions;
}

std::int64_t SessionFollower::epoch() { return database_.number("SELECT MAX(number) FROM epochs"); }

std::int64_t SessionFollower::start_of_newest(const SessionExtent& session, std::size_t count) {
  Statement rows(database_,
                 "SELECT MIN(sequence) FROM (SELECT sequence FROM keyframes WHERE session = ? "
                 "AND sequence <= ? ORDER BY sequence DESC LIMIT ?)");
  rows.bind(session.row, session.newest, static_cast<std::int64_t>(count));
  return rows.step() && !rows.is_null(0) ? rows.number(0) : 0;
}

std::vector<StoredKeyframe> SessionFollower::keyframes(std::int64_t row, std::int64_t first,
                                                       std::size_t most) {
  Statement rows(database_, std::string(kSelectKeyframes) +
                                " WHERE session = ? AND sequence >= ? ORDER BY sequence LIMIT ?");
  rows.bind(row, first, static_cast<std::int64_t>(most));
  std::vector<StoredKeyframe> keyframes;
  while (rows.step()) keyframes.push_back(keyframe_in(rows));
  return keyframes;
}

}  // namespace unimapper::store
