#include "ports/store/database.hpp"

#include <sqlite3.h>

namespace unimapper::store {

namespace {

/// Another process may be reading; it never keeps a lock for long.
constexpr int kBusyTimeoutMs = 5000;

}  // namespace

void Database::Closer::operator()(sqlite3* connection) const { sqlite3_close(connection); }

void Statement::Closer::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }

Database::Database(const std::filesystem::path& file, Access access) : file_(file) {
  const int flags =
      access == Access::kRead ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
  sqlite3* connection = nullptr;
  const int outcome =
      sqlite3_open_v2(file.c_str(), &connection, flags | SQLITE_OPEN_NOMUTEX, nullptr);
  connection_.reset(connection);
  if (outcome != SQLITE_OK) fail("cannot be opened");
  // The file may be somebody else's or damaged: no code of its schema runs.
  sqlite3_db_config(connection, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(connection, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_busy_timeout(connection, kBusyTimeoutMs);
  run("PRAGMA cell_size_check = ON");
}

void Database::run(const std::string& statements) {
  if (sqlite3_exec(handle(), statements.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK) {
    fail("cannot be used");
  }
}

std::int64_t Database::number(const std::string& query) {
  Statement statement(*this, query);
  return statement.step() ? statement.number(0) : 0;
}

std::int64_t Database::changes() const { return sqlite3_changes64(handle()); }

bool Database::is_in_transaction() const { return sqlite3_get_autocommit(handle()) == 0; }

void Database::fail(const std::string& what) const {
  throw StoreError(file_.string() + ": " + what + ": " + sqlite3_errmsg(handle()));
}

Statement::Statement(const Database& database, std::string_view text) : database_(&database) {
  sqlite3_stmt* statement = nullptr;
  const int outcome = sqlite3_prepare_v2(database.handle(), text.data(),
                                         static_cast<int>(text.size()), &statement, nullptr);
  statement_.reset(statement);
  check(outcome);
}

void Statement::check(int outcome) const {
  if (outcome != SQLITE_OK) database_->fail("cannot be read or written");
}

void Statement::reset() {
  // What it returns is the error of the step before, which was reported then.
  (void)sqlite3_reset(statement_.get());
}

bool Statement::step() {
  const int outcome = sqlite3_step(statement_.get());
  if (outcome == SQLITE_ROW) return true;
  if (outcome != SQLITE_DONE) {
    // The reason is the connection's until the next call.
    try {
      check(outcome);
    } catch (const StoreError&) {
      reset();
      throw;
    }
  }
  reset();
  return false;
}

void Statement::run() {
  while (step()) continue;
}

std::int64_t Statement::number(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

double Statement::real(int column) const { return sqlite3_column_double(statement_.get(), column); }

bool Statement::is_null(int column) const {
  return sqlite3_column_type(statement_.get(), column) == SQLITE_NULL;
}

std::string Statement::text(int column) const {
  const std::span<const std::uint8_t> found = bytes(column);
  return {found.begin(), found.end()};
}

std::span<const std::uint8_t> Statement::bytes(int column) const {
  const auto* data =
      static_cast<const std::uint8_t*>(sqlite3_column_blob(statement_.get(), column));
  return {data, static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column))};
}

void Statement::bind_one(int index, double value) {
  check(sqlite3_bind_double(statement_.get(), index, value));
}

void Statement::bind_one(int index, std::int64_t value) {
  check(sqlite3_bind_int64(statement_.get(), index, value));
}

void Statement::bind_one(int index, const std::string& value) {
  check(sqlite3_bind_text64(statement_.get(), index, value.data(), value.size(), SQLITE_TRANSIENT,
                            SQLITE_UTF8));
}

void Statement::bind_one(int index, std::span<const std::uint8_t> value) {
  check(sqlite3_bind_blob64(statement_.get(), index, value.data(), value.size(), SQLITE_STATIC));
}

void Statement::bind_one(int index, std::nullptr_t /*value*/) {
  check(sqlite3_bind_null(statement_.get(), index));
}

}  // namespace unimapper::store
