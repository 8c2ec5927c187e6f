#include "ports/store/project_writer.hpp"

#include <algorithm>
#include <chrono>

#include "ports/store/number_bytes.hpp"
#include "ports/store/transaction.hpp"
#include "unimapper/wire/checksum.hpp"

namespace unimapper::store {

namespace {

const std::filesystem::path& require_store(const std::filesystem::path& folder, bool may_make) {
  if (may_make || is_store(folder)) return folder;
  throw StoreError(folder.string() + ": is no store; `unimapper map create` makes one");
}

std::int64_t unix_time_s() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::seconds>(now).count();
}

}  // namespace

ProjectWriter::ProjectWriter(const std::filesystem::path& folder, const std::string& holder,
                             bool may_make)
    : lock_(require_store(folder, may_make), holder),
      database_(open_for_writing(folder)),
      reader_(database_),
      outcomes_(database_) {}

ProjectState ProjectWriter::current() {
  const Snapshot snapshot(database_);
  ProjectState state = reader_.current();
  Statement arrived(database_, "SELECT id FROM sessions WHERE id > ? ORDER BY id");
  arrived.bind(state.epoch.known_sessions);
  while (arrived.step()) state.sessions.push_back(arrived.number(0));
  return state;
}

std::optional<Epoch> ProjectWriter::commit(const std::string& command, const Change& change) {
  Transaction transaction(database_);
  ProjectState state = current();
  const std::int64_t parent = state.epoch.number;
  state.epoch.parent = parent;
  const std::optional<std::string> outcome = change(state);
  if (!outcome) return std::nullopt;
  state.epoch.number = parent + 1;
  state.epoch.made_s = unix_time_s();
  state.epoch.command = command;
  state.epoch.outcome = *outcome;
  state.epoch.known_sessions = database_.number("SELECT max(id) FROM sessions");
  for (StoredStatement& statement : state.statements) {
    if (statement.id == 0) keep(statement);
  }
  keep(state);
  transaction.commit();
  return state.epoch;
}

void ProjectWriter::keep(StoredStatement& statement) {
  const bool is_of_two =
      statement.kind == StatementKind::kLink || statement.kind == StatementKind::kForbidden;
  Statement insert(database_,
                   "INSERT INTO statements (kind, match_session, match_sequence, query_session, "
                   "query_sequence, pose) VALUES (?, ?, ?, ?, ?, ?)");
  const std::string kind = kind_name(statement.kind);
  const std::int64_t match = std::int64_t{statement.match.sequence};
  const std::int64_t query = std::int64_t{statement.query.sequence};
  if (!is_of_two) {
    insert.bind(kind, statement.match.session, nullptr, nullptr, nullptr, nullptr).run();
  } else if (!statement.T_match_query) {
    insert.bind(kind, statement.match.session, match, statement.query.session, query, nullptr);
    insert.run();
  } else {
    const Bytes pose = to_bytes(std::span(&*statement.T_match_query, 1));
    insert.bind(kind, statement.match.session, match, statement.query.session, query, pose).run();
  }
  statement.id = database_.number("SELECT last_insert_rowid()");
}

void ProjectWriter::keep(const ProjectState& state) {
  const Epoch& epoch = state.epoch;
  Statement insert(database_,
                   "INSERT INTO epochs (number, parent, made_s, command, outcome, known_sessions, "
                   "result) VALUES (?, ?, ?, ?, ?, ?, nullif(?, 0))");
  insert.bind(epoch.number, epoch.parent, epoch.made_s, epoch.command, epoch.outcome,
              epoch.known_sessions, epoch.result);
  insert.run();
  Statement of_session(database_, "INSERT INTO epoch_sessions (epoch, session) VALUES (?, ?)");
  for (const std::int64_t session : state.sessions) of_session.bind(epoch.number, session).run();
  Statement of_statement(database_,
                         "INSERT INTO epoch_statements (epoch, statement) VALUES (?, ?)");
  for (const StoredStatement& statement : state.statements) {
    of_statement.bind(epoch.number, statement.id).run();
  }
}

std::int64_t ProjectWriter::keep(const MapResult& result) {
  Statement(database_, "INSERT INTO results (parameters) VALUES (?)").bind(result.parameters).run();
  const std::int64_t id = database_.number("SELECT last_insert_rowid()");
  Statement of_session(database_,
                       "INSERT INTO result_sessions (result, number, session, state, reason, "
                       "anchor, sequences, poses, crc32) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)");
  std::int64_t number = 0;
  for (const SessionResult& session : result.sessions) {
    const Bytes anchor = to_bytes(std::span(&session.T_map_session, 1));
    const Bytes sequences = to_bytes(std::span<const std::uint32_t>(session.sequences));
    const Bytes poses = to_bytes(std::span<const Pose>(session.T_map_keyframe));
    of_session.bind(id, number++, session.session, session.state, session.reason, anchor, sequences,
                    poses, std::int64_t{wire::crc32(poses)});
    of_session.run();
  }
  Statement of_loop(database_,
                    "INSERT INTO result_loops (result, number, query_session, query_sequence, "
                    "match_session, match_sequence, pose, information, overlap, confidence, "
                    "accepted, by_person, reason) VALUES (?, ?, ?, ?, ?, ?, ?, nullif(?, x''), ?, "
                    "?, ?, ?, ?)");
  number = 0;
  for (const LoopResult& loop : result.loops) {
    const Bytes pose = to_bytes(std::span(&loop.T_match_query, 1));
    // Of use in the pose graph alone.
    const Bytes information =
        loop.accepted ? to_bytes(std::span<const double>(loop.information.data(), 36)) : Bytes();
    of_loop.bind(id, number++, loop.query.session, std::int64_t{loop.query.sequence},
                 loop.match.session, std::int64_t{loop.match.sequence}, pose, information,
                 loop.overlap, static_cast<double>(loop.confidence),
                 std::int64_t{loop.accepted ? 1 : 0}, std::int64_t{loop.by_person ? 1 : 0},
                 loop.reason);
    of_loop.run();
  }
  Statement of_pair(database_,
                    "INSERT INTO result_pairs (result, number, match_session, query_session, "
                    "state, reason, loops, consistent, competing, pose) "
                    "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  number = 0;
  for (const PairResult& pair : result.pairs) {
    const Bytes pose = to_bytes(std::span(&pair.T_match_query, 1));
    of_pair.bind(id, number++, pair.match, pair.query, pair.state, pair.reason,
                 to_integer(pair.loops), to_integer(pair.distinct), to_integer(pair.competing),
                 pose);
    of_pair.run();
  }
  return id;
}

}  // namespace unimapper::store
