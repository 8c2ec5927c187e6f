#include "ports/store/store_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>

namespace unimapper::store {

namespace fs = std::filesystem;

namespace {

/// "UMST": in the header of every store's database.
constexpr std::int64_t kApplicationId = 0x554D5354;

constexpr const char* kTables = R"(
CREATE TABLE sessions (
  id INTEGER PRIMARY KEY,
  identity BLOB NOT NULL UNIQUE,
  robot INTEGER NOT NULL,
  name TEXT,
  sensor TEXT,
  ended INTEGER NOT NULL DEFAULT 0,
  announced INTEGER NOT NULL DEFAULT 0,
  dropped INTEGER NOT NULL DEFAULT 0,
  keyframes INTEGER NOT NULL DEFAULT 0,
  bytes INTEGER NOT NULL DEFAULT 0,
  first_stored_s INTEGER NOT NULL
) STRICT;
CREATE TABLE keyframes (
  session INTEGER NOT NULL REFERENCES sessions (id),
  sequence INTEGER NOT NULL,
  stamp_ns INTEGER NOT NULL,
  crc32 INTEGER NOT NULL,
  bytes BLOB NOT NULL,
  PRIMARY KEY (session, sequence)
) STRICT;
CREATE TABLE health (
  session INTEGER NOT NULL REFERENCES sessions (id),
  slot INTEGER NOT NULL,
  received_s INTEGER NOT NULL,
  scans INTEGER NOT NULL,
  keyframes INTEGER NOT NULL,
  points_in INTEGER NOT NULL,
  bytes_sent INTEGER NOT NULL,
  deadline_misses INTEGER NOT NULL,
  details TEXT NOT NULL,
  PRIMARY KEY (session, slot)
) STRICT, WITHOUT ROWID;

CREATE TABLE summaries (
  session INTEGER NOT NULL REFERENCES sessions (id),
  sequence INTEGER NOT NULL,
  stamp_ns INTEGER NOT NULL,
  crc32 INTEGER NOT NULL,
  bytes BLOB NOT NULL,
  PRIMARY KEY (session, sequence)
) STRICT;

CREATE TABLE results (
  id INTEGER PRIMARY KEY,
  parameters TEXT NOT NULL,
  crc32 INTEGER
) STRICT;
CREATE TABLE epochs (
  number INTEGER PRIMARY KEY,
  parent INTEGER NOT NULL,
  made_s INTEGER NOT NULL,
  command TEXT NOT NULL,
  outcome TEXT NOT NULL,
  known_sessions INTEGER NOT NULL,
  result INTEGER REFERENCES results (id),
  purged_by INTEGER REFERENCES epochs (number)
) STRICT;
CREATE TABLE epoch_sessions (
  epoch INTEGER NOT NULL REFERENCES epochs (number),
  session INTEGER NOT NULL REFERENCES sessions (id),
  PRIMARY KEY (epoch, session)
) STRICT, WITHOUT ROWID;
CREATE TABLE statements (
  id INTEGER PRIMARY KEY,
  kind TEXT NOT NULL,
  match_session INTEGER NOT NULL REFERENCES sessions (id),
  match_sequence INTEGER,
  query_session INTEGER REFERENCES sessions (id),
  query_sequence INTEGER,
  pose BLOB
) STRICT;
CREATE TABLE epoch_statements (
  epoch INTEGER NOT NULL REFERENCES epochs (number),
  statement INTEGER NOT NULL REFERENCES statements (id),
  PRIMARY KEY (epoch, statement)
) STRICT, WITHOUT ROWID;
CREATE TABLE result_sessions (
  result INTEGER NOT NULL REFERENCES results (id),
  number INTEGER NOT NULL,
  session INTEGER NOT NULL REFERENCES sessions (id),
  state TEXT NOT NULL,
  reason TEXT NOT NULL,
  anchor BLOB NOT NULL,
  sequences BLOB NOT NULL,
  poses BLOB NOT NULL,
  crc32 INTEGER NOT NULL,
  PRIMARY KEY (result, number)
) STRICT;
CREATE TABLE result_loops (
  result INTEGER NOT NULL REFERENCES results (id),
  number INTEGER NOT NULL,
  query_session INTEGER NOT NULL REFERENCES sessions (id),
  query_sequence INTEGER NOT NULL,
  match_session INTEGER NOT NULL REFERENCES sessions (id),
  match_sequence INTEGER NOT NULL,
  pose BLOB NOT NULL,
  information BLOB,
  overlap REAL NOT NULL,
  confidence REAL NOT NULL,
  accepted INTEGER NOT NULL,
  by_person INTEGER NOT NULL,
  reason TEXT NOT NULL,
  PRIMARY KEY (result, number)
) STRICT;
CREATE TABLE result_pairs (
  result INTEGER NOT NULL REFERENCES results (id),
  number INTEGER NOT NULL,
  match_session INTEGER NOT NULL REFERENCES sessions (id),
  query_session INTEGER NOT NULL REFERENCES sessions (id),
  state TEXT NOT NULL,
  reason TEXT NOT NULL,
  loops INTEGER NOT NULL,
  consistent INTEGER NOT NULL,
  competing INTEGER NOT NULL,
  pose BLOB NOT NULL,
  PRIMARY KEY (result, number)
) STRICT;
CREATE TABLE loop_outcomes (
  query_session INTEGER NOT NULL REFERENCES sessions (id),
  query_sequence INTEGER NOT NULL,
  match_session INTEGER NOT NULL REFERENCES sessions (id),
  match_sequence INTEGER NOT NULL,
  fingerprint INTEGER NOT NULL,
  proposed BLOB NOT NULL,
  pose BLOB NOT NULL,
  information BLOB,
  overlap REAL NOT NULL,
  accepted INTEGER NOT NULL,
  reason TEXT NOT NULL,
  crc32 INTEGER NOT NULL,
  PRIMARY KEY (query_session, query_sequence, match_session, match_sequence, fingerprint, proposed)
) STRICT;
CREATE TABLE statement_positions (
  statement INTEGER NOT NULL REFERENCES statements (id),
  sequence INTEGER NOT NULL,
  position BLOB NOT NULL,
  point BLOB NOT NULL,
  sigma_xy REAL,
  sigma_z REAL NOT NULL,
  PRIMARY KEY (statement, sequence)
) STRICT, WITHOUT ROWID;
CREATE TABLE result_positions (
  result INTEGER NOT NULL REFERENCES results (id),
  number INTEGER NOT NULL,
  session INTEGER NOT NULL REFERENCES sessions (id),
  sequence INTEGER NOT NULL,
  position BLOB NOT NULL,
  point BLOB NOT NULL,
  sigma_xy REAL,
  sigma_z REAL NOT NULL,
  used INTEGER NOT NULL,
  reason TEXT NOT NULL,
  residual BLOB NOT NULL,
  PRIMARY KEY (result, number)
) STRICT, WITHOUT ROWID;
CREATE TABLE result_georeferences (
  result INTEGER PRIMARY KEY REFERENCES results (id),
  origin BLOB NOT NULL,
  horizontal INTEGER NOT NULL,
  heading_sigma REAL
) STRICT;
CREATE TABLE placement_outcomes (
  query_session INTEGER NOT NULL REFERENCES sessions (id),
  match_session INTEGER NOT NULL REFERENCES sessions (id),
  fingerprint INTEGER NOT NULL,
  supporting INTEGER NOT NULL,
  contradicting INTEGER NOT NULL,
  aliasing TEXT NOT NULL,
  crc32 INTEGER NOT NULL,
  PRIMARY KEY (query_session, match_session, fingerprint)
) STRICT;
)";

/// Of later versions of the schema; earlier ones leave it alone.
constexpr const char* kLaterTables = R"(
CREATE TABLE IF NOT EXISTS epoch_systems (
  epoch INTEGER PRIMARY KEY REFERENCES epochs (number) ON DELETE CASCADE,
  crs TEXT NOT NULL
) STRICT;
CREATE TABLE IF NOT EXISTS handed_on_keyframes (
  session INTEGER NOT NULL REFERENCES sessions (id),
  sequence INTEGER NOT NULL,
  PRIMARY KEY (session, sequence)
) STRICT, WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS handed_on_sessions (
  session INTEGER PRIMARY KEY REFERENCES sessions (id),
  message BLOB NOT NULL
) STRICT
)";

std::string reason() { return std::strerror(errno); }

/// The schema's number, 0 of a new database. Throws StoreError for what is no store of ours.
std::int64_t schema_of(Database& database) {
  const std::string file = database.file().string();
  // The first read: whatever is no database shows here.
  const std::int64_t objects = database.number("SELECT COUNT(*) FROM sqlite_master");
  const std::int64_t schema = database.number("PRAGMA user_version");
  if (objects == 0 && schema == 0) return 0;
  if (database.number("PRAGMA application_id") != kApplicationId) {
    throw StoreError(file + ": is a database, but no store of Uni-Mapper");
  }
  if (schema != kSchemaVersion) {
    throw StoreError(file + ": was written by " +
                     (schema > kSchemaVersion ? "a newer" : "an earlier") +
                     " version of Uni-Mapper (schema " + std::to_string(schema) +
                     ", this version knows " + std::to_string(kSchemaVersion) + ")");
  }
  return schema;
}

/// All tables or none.
void create_tables(Database& database) {
  database.run(std::string("BEGIN IMMEDIATE;") + kTables +
               "PRAGMA application_id = " + std::to_string(kApplicationId) +
               ";PRAGMA user_version = " + std::to_string(kSchemaVersion) + ";COMMIT");
}

}  // namespace

fs::path database_of(const fs::path& folder) { return folder / kDatabaseName; }

bool is_store(const fs::path& path) {
  std::error_code error;
  return fs::exists(database_of(path), error);
}

bool has_tables(const fs::path& folder) {
  if (!is_store(folder)) return false;
  Database database(database_of(folder), Access::kRead);
  return schema_of(database) != 0;
}

StoreLock::StoreLock(const fs::path& folder, const std::string& holder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw StoreError(folder.string() + ": cannot be made: " + error.message());
  const fs::path file = folder / "lock";
  descriptor_ = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (descriptor_ < 0) throw StoreError(file.string() + ": cannot be opened: " + reason());
  if (flock(descriptor_, LOCK_EX | LOCK_NB) == 0) {
    // For whoever finds it locked; a full disk is no obstacle.
    const std::string text = std::to_string(getpid()) + " " + holder + "\n";
    if (ftruncate(descriptor_, 0) != 0 || write(descriptor_, text.data(), text.size()) < 0) return;
    return;
  }
  const bool is_held = errno == EWOULDBLOCK;
  const std::string why = reason();
  close(descriptor_);
  if (!is_held) throw StoreError(file.string() + ": cannot be locked: " + why);
  std::string process;
  std::string other;
  std::ifstream held(file);
  std::getline(held >> process >> std::ws, other);
  throw StoreError(folder.string() + ": " + (other.empty() ? "another process" : other) +
                   " writes to this store" + (process.empty() ? "" : " (process " + process + ")"));
}

StoreLock::~StoreLock() { close(descriptor_); }

Database open_for_writing(const fs::path& folder) {
  Database database(database_of(folder), Access::kWrite);
  const bool is_new = schema_of(database) == 0;
  // The size of a page takes effect in a new database only.
  database.run(
      "PRAGMA page_size = 8192;"
      "PRAGMA journal_mode = WAL;"
      "PRAGMA synchronous = FULL;"
      "PRAGMA foreign_keys = ON;"
      "PRAGMA cache_size = -4096;"
      "PRAGMA wal_autocheckpoint = 1000;"
      "PRAGMA journal_size_limit = 16777216");
  if (is_new) create_tables(database);
  database.run(kLaterTables);
  return database;
}

Database open_for_reading(const fs::path& folder) {
  const fs::path file = database_of(folder);
  std::error_code error;
  if (!fs::exists(file, error)) throw StoreError(folder.string() + ": is no store");
  Database database(file, Access::kRead);
  if (schema_of(database) == 0) throw StoreError(file.string() + ": has no tables yet");
  return database;
}

}  // namespace unimapper::store
