// Bags of ROS 2 in SQLite databases.
#include <sqlite3.h>

#include <algorithm>
#include <map>
#include <system_error>

#include "ports/datasets/bag/decompress.hpp"
#include "ports/datasets/bag/message_source.hpp"
#include "ports/datasets/files.hpp"

namespace unimapper::datasets::bag {

namespace {

/// Messages that were compressed one by one begin like this; no serialized message does.
constexpr std::string_view kZstdMagic = "\x28\xB5\x2F\xFD";

struct DatabaseCloser {
  void operator()(sqlite3* database) const { sqlite3_close(database); }
};
struct StatementCloser {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
struct BlobCloser {
  void operator()(sqlite3_blob* blob) const { sqlite3_blob_close(blob); }
};
using Database = std::unique_ptr<sqlite3, DatabaseCloser>;
using Statement = std::unique_ptr<sqlite3_stmt, StatementCloser>;
using Blob = std::unique_ptr<sqlite3_blob, BlobCloser>;

/// The file's name as SQLite wants it where options follow.
std::string uri_of(const std::filesystem::path& file, const std::string& options) {
  std::string uri = "file:";
  for (const char c : std::filesystem::absolute(file).string()) {
    if (c == '%' || c == '?' || c == '#') {
      constexpr std::string_view kDigits = "0123456789ABCDEF";
      uri += {'%', kDigits[static_cast<unsigned char>(c) >> 4], kDigits[c & 0xF]};
    } else {
      uri += c;
    }
  }
  return uri + "?" + options;
}

/// What a recorder that was cut off had not yet put into the database.
bool has_journal(const std::filesystem::path& file) {
  std::error_code error;
  const auto bytes = std::filesystem::file_size(file.string() + "-wal", error);
  return !error && bytes > 0;
}

std::string column_text(sqlite3_stmt* row, int column) {
  const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(row, column));
  return text != nullptr
             ? std::string(text, static_cast<std::size_t>(sqlite3_column_bytes(row, column)))
             : std::string();
}

class SqliteSource final : public MessageSource {
 public:
  explicit SqliteSource(std::filesystem::path path) : path_(std::move(path)) {
    open();
    for (const char* table : {"topics", "messages"}) require_table(table);
    read_topics();
    read_index();
    finish();
  }

  std::string_view read(const MessagePlace& place, std::size_t limit) override {
    const auto row = static_cast<sqlite3_int64>(place.offset);
    try {
      return read_blob(row, limit);
    } catch (const DatasetError& error) {
      fail(path_, "message " + std::to_string(row) + ": " + error.what());
    }
  }

 private:
  void open() {
    // A file that nobody writes to needs no locks, which a folder may not allow.
    const std::string options = has_journal(path_) ? "mode=ro" : "mode=ro&immutable=1";
    sqlite3* database = nullptr;
    const int outcome =
        sqlite3_open_v2(uri_of(path_, options).c_str(), &database,
                        SQLITE_OPEN_READONLY | SQLITE_OPEN_URI | SQLITE_OPEN_NOMUTEX, nullptr);
    database_.reset(database);
    if (outcome != SQLITE_OK) fail(path_, std::string("cannot open: ") + reason());
    // The file is somebody else's: no code of its schema runs, no row fills the memory.
    sqlite3_db_config(database, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    sqlite3_db_config(database, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
    sqlite3_limit(database, SQLITE_LIMIT_LENGTH, static_cast<int>(kMaxBlockBytes));
    sqlite3_exec(database, "PRAGMA cell_size_check = ON", nullptr, nullptr, nullptr);
    const char* look = "SELECT 1 FROM sqlite_master";
    if (sqlite3_exec(database, look, nullptr, nullptr, nullptr) != SQLITE_CORRUPT) return;
    // SQLite reads a file that lacks its end only for those who may write its schema. Here nobody
    // does: it is open for reading.
    sqlite3_db_config(database, SQLITE_DBCONFIG_DEFENSIVE, 0, nullptr);
    sqlite3_exec(database, "PRAGMA writable_schema = ON", nullptr, nullptr, nullptr);
    if (sqlite3_exec(database, look, nullptr, nullptr, nullptr) != SQLITE_OK) return;
    warn("the end of the database is missing: what lies before is read");
  }

  [[nodiscard]] std::string reason() const { return sqlite3_errmsg(database_.get()); }

  Statement prepare(const std::string& query) {
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(database_.get(), query.c_str(), -1, &statement, nullptr) != SQLITE_OK) {
      const bool is_torn = sqlite3_errcode(database_.get()) == SQLITE_CORRUPT;
      fail(path_, (is_torn ? "is damaged or cut short; copy it again: " : "is no bag of ROS 2: ") +
                      reason());
    }
    return Statement(statement);
  }

  /// Views are refused: what they compute is not bounded by the file.
  void require_table(const std::string& name) {
    const Statement statement =
        prepare("SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = '" + name +
                "' AND sql NOT LIKE 'CREATE VIRTUAL%'");
    const int outcome = sqlite3_step(statement.get());
    if (outcome == SQLITE_ROW) return;
    fail(path_, outcome == SQLITE_DONE ? "is no bag of ROS 2: it has no table '" + name + "'"
                                       : "cannot be read: " + reason());
  }

  void read_topics() {
    const Statement rows = prepare("SELECT id, name, type, serialization_format FROM topics");
    int outcome = SQLITE_ROW;
    while ((outcome = sqlite3_step(rows.get())) == SQLITE_ROW) {
      topic_of_[sqlite3_column_int64(rows.get(), 0)] =
          add_topic(column_text(rows.get(), 1), column_text(rows.get(), 2),
                    parse_serialization(column_text(rows.get(), 3)));
    }
    if (outcome != SQLITE_DONE) fail(path_, "its topics cannot be read: " + reason());
  }

  void read_index() {
    const Statement rows = prepare("SELECT rowid, topic_id, timestamp FROM messages");
    std::uint64_t count = 0;
    std::uint64_t unknown = 0;
    int outcome = SQLITE_ROW;
    while ((outcome = sqlite3_step(rows.get())) == SQLITE_ROW) {
      ++count;
      const auto topic = topic_of_.find(sqlite3_column_int64(rows.get(), 1));
      if (topic == topic_of_.end()) {
        ++unknown;
        continue;
      }
      const auto row = static_cast<std::uint64_t>(sqlite3_column_int64(rows.get(), 0));
      add_message(topic->second, {sqlite3_column_int64(rows.get(), 2), row, 0, 0});
    }
    if (outcome != SQLITE_DONE) {
      warn("the database is damaged (" + reason() + "): the " + std::to_string(count) +
           " messages before the damage are read");
    }
    if (unknown > 0) warn(std::to_string(unknown) + " messages of unknown topics are left out");
  }

  std::string_view read_blob(sqlite3_int64 row, std::size_t limit) {
    if (blob_ == nullptr || sqlite3_blob_reopen(blob_.get(), row) != SQLITE_OK) {
      blob_.reset();
      sqlite3_blob* blob = nullptr;
      if (sqlite3_blob_open(database_.get(), "main", "messages", "data", row, 0, &blob) !=
          SQLITE_OK) {
        throw DatasetError("cannot be read: " + reason());
      }
      blob_.reset(blob);
    }
    const auto bytes = static_cast<std::size_t>(sqlite3_blob_bytes(blob_.get()));
    take(0, std::min(bytes, std::max(limit, kZstdMagic.size())));
    if (!message_.starts_with(kZstdMagic)) return std::string_view(message_).substr(0, limit);
    take(message_.size(), bytes);
    message_ = decompress_prefix(message_, Compression::kZstd,
                                 std::min<std::uint64_t>(limit, kMaxBlockBytes));
    return message_;
  }

  /// Reads the open message's bytes from `begin` to `end` behind what is there.
  void take(std::size_t begin, std::size_t end) {
    message_.resize(end);
    if (sqlite3_blob_read(blob_.get(), message_.data() + begin, static_cast<int>(end - begin),
                          static_cast<int>(begin)) != SQLITE_OK) {
      blob_.reset();
      throw DatasetError("cannot be read: " + reason());
    }
  }

  std::filesystem::path path_;
  Database database_;
  Blob blob_;
  std::map<sqlite3_int64, std::size_t> topic_of_;
  std::string message_;
};

}  // namespace

std::unique_ptr<MessageSource> open_sqlite_bag(const std::filesystem::path& file) {
  return std::make_unique<SqliteSource>(file);
}

}  // namespace unimapper::datasets::bag
