// SQLite connections and statements that close themselves and report errors in words.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

struct sqlite3;
struct sqlite3_stmt;

namespace unimapper::store {

/// A store could not be opened, read or written. The message names the file and the reason.
class StoreError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// SQLite's integers are signed: numbers that are unsigned by nature keep their bits.
constexpr std::int64_t to_integer(std::uint64_t number) {
  return static_cast<std::int64_t>(number);
}

/// How a database is opened.
enum class Access : std::uint8_t { kRead, kWrite };

/// One connection. Not thread safe.
class Database {
 public:
  /// Opens a file; with `kWrite` an absent one is made. Throws StoreError.
  Database(const std::filesystem::path& file, Access access);

  /// Runs statements that return nothing. Throws StoreError.
  void run(const std::string& statements);
  /// First column of the first row, as number; 0 without a row. Throws StoreError.
  std::int64_t number(const std::string& query);
  /// Rows inserted, changed or removed by the last statement.
  [[nodiscard]] std::int64_t changes() const;
  /// Whether a transaction is open.
  [[nodiscard]] bool is_in_transaction() const;
  /// Throws StoreError with what was tried and SQLite's reason.
  [[noreturn]] void fail(const std::string& what) const;

  /// The connection itself.
  [[nodiscard]] sqlite3* handle() const { return connection_.get(); }
  /// The file.
  [[nodiscard]] const std::filesystem::path& file() const { return file_; }

 private:
  struct Closer {
    void operator()(sqlite3* connection) const;
  };
  std::filesystem::path file_;
  std::unique_ptr<sqlite3, Closer> connection_;
};

/// A prepared statement; parameters and columns count from 0. All functions throw StoreError.
class Statement {
 public:
  Statement(const Database& database, std::string_view text);

  /// Binds the parameters in order: integers, text, bytes (the caller's, until the statement has
  /// run), nothing for `nullptr`.
  template <typename... Values>
  Statement& bind(const Values&... values) {
    reset();
    int index = 0;
    (bind_one(++index, values), ...);
    return *this;
  }
  /// Next row; false after the last. The statement starts over with `bind`.
  bool step();
  /// Runs a statement that returns no row.
  void run();

  [[nodiscard]] std::int64_t number(int column) const;
  [[nodiscard]] double real(int column) const;
  [[nodiscard]] bool is_null(int column) const;
  [[nodiscard]] std::string text(int column) const;
  /// Valid until the next step.
  [[nodiscard]] std::span<const std::uint8_t> bytes(int column) const;

  /// Ends a query that was not read to its end.
  void reset();

 private:
  struct Closer {
    void operator()(sqlite3_stmt* statement) const;
  };
  void bind_one(int index, std::int64_t value);
  void bind_one(int index, double value);
  void bind_one(int index, const std::string& value);
  void bind_one(int index, std::span<const std::uint8_t> value);
  void bind_one(int index, const std::vector<std::uint8_t>& value) {
    bind_one(index, std::span(value));
  }
  void bind_one(int index, std::nullptr_t value);
  void check(int outcome) const;

  const Database* database_;
  std::unique_ptr<sqlite3_stmt, Closer> statement_;
};

}  // namespace unimapper::store
