#include "ports/store/project_reader.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "ports/store/number_bytes.hpp"
#include "ports/store/position_tables.hpp"
#include "ports/store/result_checksum.hpp"
#include "ports/store/store_file.hpp"
#include "ports/store/transaction.hpp"
#include "unimapper/wire/byte_io.hpp"

namespace unimapper::store {

namespace {

constexpr std::array<std::pair<StatementKind, const char*>, 5> kKinds = {
    {{StatementKind::kLink, "link"},
     {StatementKind::kForbidden, "forbidden"},
     {StatementKind::kApart, "apart"},
     {StatementKind::kReference, "reference"},
     {StatementKind::kPosition, "position"}}};

/// Begins a query whose rows `epoch_of` reads.
constexpr const char* kSelectEpochs =
    "SELECT number, parent, made_s, command, outcome, known_sessions, result, purged_by "
    "FROM epochs ";

Epoch epoch_of(const Statement& row) {
  Epoch epoch;
  epoch.number = row.number(0);
  epoch.parent = row.number(1);
  epoch.made_s = row.number(2);
  epoch.command = row.text(3);
  epoch.outcome = row.text(4);
  epoch.known_sessions = row.number(5);
  epoch.result = row.is_null(6) ? 0 : row.number(6);
  epoch.purged_by = row.is_null(7) ? 0 : row.number(7);
  return epoch;
}

[[noreturn]] void damaged(const Database& database, const std::string& what) {
  throw StoreError(database.file().string() + ": " + what + " is damaged");
}

Pose pose_of(const Database& database, std::span<const std::uint8_t> bytes,
             const std::string& what) {
  const auto poses = to_poses(bytes);
  if (!poses || poses->size() != 1) damaged(database, what);
  return poses->front();
}

StatementKind kind_of(const Database& database, const std::string& name) {
  for (const auto& [kind, word] : kKinds) {
    if (name == word) return kind;
  }
  damaged(database, "a statement");
}

std::uint32_t sequence_of(const Statement& row, int column) {
  return static_cast<std::uint32_t>(row.number(column));
}

}  // namespace

const char* kind_name(StatementKind kind) {
  for (const auto& [known, word] : kKinds) {
    if (known == kind) return word;
  }
  return "";
}

ProjectReader::ProjectReader(Database& database) : database_(database) {}

std::vector<Epoch> ProjectReader::epochs() {
  std::vector<Epoch> epochs;
  Statement rows(database_, std::string(kSelectEpochs) + "ORDER BY number");
  while (rows.step()) epochs.push_back(epoch_of(rows));
  return epochs;
}

ProjectState ProjectReader::next() {
  const Snapshot snapshot(database_);
  ProjectState state = current();
  Statement arrived(database_, "SELECT id FROM sessions WHERE id > ? ORDER BY id");
  arrived.bind(state.epoch.known_sessions);
  while (arrived.step()) state.sessions.push_back(arrived.number(0));
  return state;
}

ProjectState ProjectReader::current() {
  const Snapshot snapshot(database_);
  const std::int64_t last = database_.number("SELECT max(number) FROM epochs");
  return last == 0 ? ProjectState{} : at(last);
}

ProjectState ProjectReader::at(std::int64_t number) {
  const Snapshot snapshot(database_);
  ProjectState state;
  Statement row(database_, std::string(kSelectEpochs) + "WHERE number = ?");
  row.bind(number);
  if (row.step()) state.epoch = epoch_of(row);
  if (state.epoch.number == 0) {
    throw StoreError(database_.file().parent_path().string() + ": has no epoch " +
                     std::to_string(number));
  }
  if (state.epoch.purged_by != 0) {
    throw StoreError(database_.file().parent_path().string() + ": epoch " + std::to_string(number) +
                     " cannot be shown or gone back to: epoch " +
                     std::to_string(state.epoch.purged_by) + " removed a session of it for good");
  }
  Statement sessions(database_,
                     "SELECT session FROM epoch_sessions WHERE epoch = ? ORDER BY session");
  sessions.bind(number);
  while (sessions.step()) state.sessions.push_back(sessions.number(0));
  Statement rows(database_,
                 "SELECT id, kind, match_session, match_sequence, query_session, query_sequence, "
                 "pose FROM statements JOIN epoch_statements ON statement = id WHERE epoch = ? "
                 "ORDER BY id");
  rows.bind(number);
  while (rows.step()) {
    StoredStatement& statement = state.statements.emplace_back();
    statement.id = rows.number(0);
    statement.kind = kind_of(database_, rows.text(1));
    statement.match = {rows.number(2), sequence_of(rows, 3)};
    statement.query = {rows.number(4), sequence_of(rows, 5)};
    if (!rows.is_null(6)) statement.T_match_query = pose_of(database_, rows.bytes(6), "a link");
  }
  read_positions(database_, state);
  // A store that no later version has written to yet has no such table.
  if (database_.number("SELECT COUNT(*) FROM sqlite_master WHERE name = 'epoch_systems'") == 0) {
    return state;
  }
  Statement system(database_, "SELECT crs FROM epoch_systems WHERE epoch = ?");
  system.bind(number);
  if (system.step()) state.crs = system.text(0);
  return state;
}

std::map<std::int64_t, std::int64_t> ProjectReader::pose_checksums(std::int64_t result) {
  std::map<std::int64_t, std::int64_t> checksums;
  Statement rows(database_, "SELECT session, crc32 FROM result_sessions WHERE result = ?");
  rows.bind(result);
  while (rows.step()) checksums[rows.number(0)] = rows.number(1);
  return checksums;
}

MapResult ProjectReader::result(std::int64_t id) {
  const Snapshot snapshot(database_);
  MapResult result;
  const std::string none = database_.file().string() + ": has no result " + std::to_string(id);
  Statement whole(database_, "SELECT parameters, crc32 FROM results WHERE id = ?");
  whole.bind(id);
  if (!whole.step()) throw StoreError(none);
  result.parameters = whole.text(0);
  Statement sessions(database_,
                     "SELECT session, state, reason, anchor, sequences, poses, crc32 FROM "
                     "result_sessions WHERE result = ? ORDER BY number");
  sessions.bind(id);
  while (sessions.step()) {
    SessionResult& session = result.sessions.emplace_back();
    session.session = sessions.number(0);
    const std::string what = "the result of session " + std::to_string(session.session);
    session.state = sessions.text(1);
    session.reason = sessions.text(2);
    session.T_map_session = pose_of(database_, sessions.bytes(3), what);
    auto sequences = to_numbers(sessions.bytes(4));
    auto poses = to_poses(sessions.bytes(5));
    if (!sequences || !poses || poses->size() != sequences->size() ||
        std::int64_t{wire::crc32(sessions.bytes(5))} != sessions.number(6)) {
      damaged(database_, what);
    }
    session.sequences = std::move(*sequences);
    session.T_map_keyframe = std::move(*poses);
  }
  Statement loops(database_,
                  "SELECT query_session, query_sequence, match_session, match_sequence, pose, "
                  "information, overlap, confidence, accepted, by_person, reason FROM result_loops "
                  "WHERE result = ? ORDER BY number");
  loops.bind(id);
  while (loops.step()) {
    LoopResult& loop = result.loops.emplace_back();
    loop.query = {loops.number(0), sequence_of(loops, 1)};
    loop.match = {loops.number(2), sequence_of(loops, 3)};
    loop.T_match_query = pose_of(database_, loops.bytes(4), "a loop");
    if (!loops.is_null(5)) {
      const auto numbers = to_doubles(loops.bytes(5));
      if (!numbers || numbers->size() != 36) damaged(database_, "a loop");
      std::copy(numbers->begin(), numbers->end(), loop.information.data());
    }
    loop.overlap = loops.real(6);
    loop.confidence = static_cast<float>(loops.real(7));
    loop.accepted = loops.number(8) != 0;
    loop.by_person = loops.number(9) != 0;
    loop.reason = loops.text(10);
  }
  Statement pairs(database_,
                  "SELECT match_session, query_session, state, reason, loops, consistent, "
                  "competing, pose FROM result_pairs WHERE result = ? ORDER BY number");
  pairs.bind(id);
  while (pairs.step()) {
    PairResult& pair = result.pairs.emplace_back();
    pair.match = pairs.number(0);
    pair.query = pairs.number(1);
    pair.state = pairs.text(2);
    pair.reason = pairs.text(3);
    pair.loops = static_cast<std::uint64_t>(pairs.number(4));
    pair.distinct = static_cast<std::uint64_t>(pairs.number(5));
    pair.competing = static_cast<std::uint64_t>(pairs.number(6));
    pair.T_match_query = pose_of(database_, pairs.bytes(7), "a pair of sessions");
  }
  read_positions(database_, id, result);
  if (!whole.is_null(1) && whole.number(1) != checksum_of(result)) {
    damaged(database_, "result " + std::to_string(id));
  }
  return result;
}

}  // namespace unimapper::store
