// Recordings of ROS 2 messages as SQLite files with their metadata: rosbag2.
#include <sqlite3.h>

#include <algorithm>
#include <memory>
#include <system_error>
#include <vector>

#include "ports/bag_writers/containers.hpp"
#include "ports/bag_writers/message_definitions.hpp"
#include "ports/bag_writers/output_file.hpp"

namespace unimapper::bags {

namespace fs = std::filesystem;

namespace {

/// The tables of rosbag2's third schema (ROS 2 Humble), which later releases read too.
constexpr const char* kTables =
    "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);"
    "INSERT INTO schema(schema_version, ros_distro) VALUES (3, 'humble');"
    "CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL,"
    " metadata TEXT NOT NULL);"
    "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,"
    " serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);"
    "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL,"
    " timestamp INTEGER NOT NULL, data BLOB NOT NULL);"
    "CREATE INDEX timestamp_idx ON messages (timestamp ASC);";

/// Database that throws.
class Database {
 public:
  explicit Database(fs::path file) : file_(std::move(file)) {
    sqlite3* opened = nullptr;
    const int result = sqlite3_open(file_.c_str(), &opened);
    connection_.reset(opened);
    check(result);
  }

  void execute(const char* statement) const {
    check(sqlite3_exec(connection_.get(), statement, nullptr, nullptr, nullptr));
  }

  [[nodiscard]] sqlite3_stmt* prepare(const char* statement) const {
    sqlite3_stmt* prepared = nullptr;
    check(sqlite3_prepare_v2(connection_.get(), statement, -1, &prepared, nullptr));
    return prepared;
  }

  void check(int result) const {
    if (result == SQLITE_OK || result == SQLITE_DONE) return;
    throw BagError(file_.string() + ": cannot write: " + sqlite3_errmsg(connection_.get()));
  }

  void close() {
    const int result = sqlite3_close(connection_.get());
    check(result);
    static_cast<void>(connection_.release());
  }

 private:
  struct Close {
    void operator()(sqlite3* connection) const { sqlite3_close(connection); }
  };
  fs::path file_;
  std::unique_ptr<sqlite3, Close> connection_;
};

/// Statement that inserts rows.
class Insertion {
 public:
  Insertion(const Database& database, const char* text)
      : database_(database), statement_(database.prepare(text)) {}

  Insertion& bind(int column, std::int64_t value) {
    database_.check(sqlite3_bind_int64(statement_.get(), column, value));
    return *this;
  }
  Insertion& bind(int column, std::string_view text) {
    database_.check(sqlite3_bind_text(statement_.get(), column, text.data(),
                                      static_cast<int>(text.size()), SQLITE_TRANSIENT));
    return *this;
  }
  Insertion& bind_bytes(int column, std::string_view bytes) {
    database_.check(
        sqlite3_bind_blob64(statement_.get(), column, bytes.data(), bytes.size(), SQLITE_STATIC));
    return *this;
  }
  void run() {
    database_.check(sqlite3_step(statement_.get()));
    database_.check(sqlite3_reset(statement_.get()));
  }

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
  };
  const Database& database_;
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
};

/// `text` as a double-quoted scalar of YAML.
std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '\n') {
      result += "\\n";
      continue;
    }
    if (c == '"' || c == '\\') result += '\\';
    result += c;
  }
  return result + '"';
}

class Rosbag2 : public BagWriter {
 public:
  explicit Rosbag2(const fs::path& folder)
      : BagWriter(Encoding::kCdr),
        folder_(folder),
        file_name_(folder.filename().string() + "_0.db3"),
        database_(empty_file(folder, file_name_)) {
    database_.execute(kTables);
    database_.execute("BEGIN");
    insert_ = std::make_unique<Insertion>(
        database_, "INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)");
  }

  std::size_t add_topic(const Topic& topic) override {
    topics_.push_back({topic, 0});
    Insertion(database_,
              "INSERT INTO topics(id, name, type, serialization_format, offered_qos_profiles) "
              "VALUES (?, ?, ?, 'cdr', ?)")
        .bind(1, static_cast<std::int64_t>(topics_.size()))
        .bind(2, topic.name)
        .bind(3, ros2_name(topic.type))
        .bind(4, offered_qos_profiles(topic))
        .run();
    return topics_.size() - 1;
  }

  void close() override {
    insert_.reset();
    const std::string metadata = describe();
    Insertion(database_, "INSERT INTO metadata(metadata_version, metadata) VALUES (5, ?)")
        .bind(1, metadata)
        .run();
    database_.execute("COMMIT");
    database_.close();
    OutputFile file(folder_ / "metadata.yaml");
    file.write(metadata);
    file.close();
  }

 protected:
  void write_bytes(std::size_t topic, std::int64_t stamp_ns, std::string_view message) override {
    insert_->bind(1, static_cast<std::int64_t>(topic + 1))
        .bind(2, stamp_ns)
        .bind_bytes(3, message)
        .run();
    first_ns_ = messages_ == 0 ? stamp_ns : std::min(first_ns_, stamp_ns);
    last_ns_ = std::max(last_ns_, stamp_ns);
    ++messages_;
    ++topics_[topic].messages;
  }

 private:
  struct TopicCount {
    Topic topic;
    std::uint64_t messages;
  };

  /// The file in the folder, which is made; what an earlier recording left there is removed.
  static fs::path empty_file(const fs::path& folder, const std::string& name) {
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) throw BagError(folder.string() + ": cannot create: " + error.message());
    fs::remove(folder / name, error);
    return folder / name;
  }

  [[nodiscard]] std::string describe() const {
    const std::string extent =
        "duration:\n        nanoseconds: " + std::to_string(last_ns_ - first_ns_) +
        "\n      message_count: " + std::to_string(messages_) + "\n";
    std::string text =
        "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n"
        "  duration:\n    nanoseconds: " +
        std::to_string(last_ns_ - first_ns_) +
        "\n  starting_time:\n    nanoseconds_since_epoch: " + std::to_string(first_ns_) +
        "\n  message_count: " + std::to_string(messages_) + "\n  topics_with_message_count:\n";
    for (const TopicCount& entry : topics_) {
      text += "    - topic_metadata:\n        name: " + entry.topic.name +
              "\n        type: " + ros2_name(entry.topic.type) +
              "\n        serialization_format: cdr\n        offered_qos_profiles: " +
              quoted(offered_qos_profiles(entry.topic)) +
              "\n      message_count: " + std::to_string(entry.messages) + "\n";
    }
    return text +
           "  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:\n    - " +
           file_name_ + "\n  files:\n    - path: " + file_name_ +
           "\n      starting_time:\n        nanoseconds_since_epoch: " + std::to_string(first_ns_) +
           "\n      " + extent;
  }

  fs::path folder_;
  std::string file_name_;
  Database database_;
  std::unique_ptr<Insertion> insert_;  // before the database is closed
  std::vector<TopicCount> topics_;
  std::uint64_t messages_ = 0;
  std::int64_t first_ns_ = 0, last_ns_ = 0;
};

}  // namespace

std::unique_ptr<BagWriter> create_rosbag2(const fs::path& folder) {
  return std::make_unique<Rosbag2>(folder);
}

}  // namespace unimapper::bags
