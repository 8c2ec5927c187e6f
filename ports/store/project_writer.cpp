#include "ports/store/project_writer.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "ports/store/number_bytes.hpp"
#include "ports/store/position_tables.hpp"
#include "ports/store/result_checksum.hpp"
#include "ports/store/session_purge.hpp"
#include "ports/store/transaction.hpp"
#include "unimapper/wire/byte_io.hpp"

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
    : lock_(std::in_place, require_store(folder, may_make), holder),
      database_(open_for_writing(folder)),
      reader_(database_),
      outcomes_(database_),
      placements_(database_) {}

ProjectWriter::ProjectWriter(const std::filesystem::path& folder, const StoreLock&)
    : database_(open_for_writing(require_store(folder, false))),
      reader_(database_),
      outcomes_(database_),
      placements_(database_) {}

ProjectState ProjectWriter::current() { return reader_.next(); }

std::optional<Epoch> ProjectWriter::commit(const std::string& command, const Change& change) {
  Transaction transaction(database_);
  ProjectState state = current();
  state.epoch.parent = state.epoch.number;
  state.epoch.command = command;
  std::optional<Epoch> epoch = finish(state, state.epoch.number + 1, change);
  if (epoch) transaction.commit();
  return epoch;
}

std::optional<Epoch> ProjectWriter::replace(std::int64_t number, const Change& change) {
  Transaction transaction(database_);
  ProjectState state = current();
  if (state.epoch.number != number) {
    throw StoreError(database_.file().parent_path().string() + ": epoch " + std::to_string(number) +
                     " is not the latest");
  }
  remove_epoch(number);
  std::optional<Epoch> epoch = finish(state, number, change);
  if (!epoch) return epoch;
  remove_unused_results();
  transaction.commit();
  return epoch;
}

Epoch ProjectWriter::purge(const std::string& command, const std::string& outcome,
                           const std::vector<std::int64_t>& sessions) {
  Transaction transaction(database_);
  ProjectState state = current();
  state.epoch.parent = state.epoch.number;
  state.epoch.command = command;
  const std::int64_t number = state.epoch.number + 1;
  std::optional<Epoch> epoch = finish(state, number, [&](ProjectState& changed) {
    for (const std::int64_t session : sessions) take_out(session, changed);
    return std::optional(outcome);
  });
  purge_sessions(database_, sessions, number);
  remove_unused_results();
  transaction.commit();
  return *epoch;
}

void ProjectWriter::give_back_space() { database_.run("VACUUM; PRAGMA wal_checkpoint(TRUNCATE)"); }

/// The rest of a change whose parent and command are known.
std::optional<Epoch> ProjectWriter::finish(ProjectState& state, std::int64_t number,
                                           const Change& change) {
  const std::optional<std::string> outcome = change(state);
  if (!outcome) return std::nullopt;
  state.epoch.number = number;
  state.epoch.made_s = unix_time_s();
  state.epoch.outcome = *outcome;
  state.epoch.known_sessions = database_.number("SELECT max(id) FROM sessions");
  for (StoredStatement& statement : state.statements) {
    if (statement.id == 0) keep(statement);
  }
  keep(state);
  return state.epoch;
}

void ProjectWriter::remove_epoch(std::int64_t number) {
  for (const char* table : {"epoch_sessions WHERE epoch", "epoch_statements WHERE epoch",
                            "epoch_systems WHERE epoch", "epochs WHERE number"}) {
    Statement(database_, std::string("DELETE FROM ") + table + " = ?").bind(number).run();
  }
}

void ProjectWriter::remove_unused_results() {
  for (const char* table :
       {"result_sessions WHERE result", "result_loops WHERE result", "result_pairs WHERE result",
        "result_positions WHERE result", "result_georeferences WHERE result", "results WHERE id"}) {
    database_.run(std::string("DELETE FROM ") + table +
                  " NOT IN (SELECT result FROM epochs WHERE result IS NOT NULL)");
  }
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
  keep_positions(database_, statement);
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
  if (state.crs.empty()) return;
  Statement(database_, "INSERT INTO epoch_systems (epoch, crs) VALUES (?, ?)")
      .bind(epoch.number, state.crs)
      .run();
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
  keep_positions(database_, id, result);
  Statement(database_, "UPDATE results SET crc32 = ? WHERE id = ?")
      .bind(checksum_of(result), id)
      .run();
  return id;
}

}  // namespace unimapper::store
