// Messages of a recording by topic, in order of time and at random.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

namespace unimapper::datasets::bag {

/// How the messages of a topic are written as bytes.
enum class Serialization : std::uint8_t {
  kRos1,   ///< ROS 1: packed, little endian
  kCdr,    ///< ROS 2: XCDR1, its first bytes say in which byte order
  kOther,  ///< anything else; such messages are not read
};

/// Parses "ros1" or "cdr".
Serialization parse_serialization(std::string_view name);

/// One topic of a recording.
struct Topic {
  std::string name;  ///< e.g. "/points"
  std::string type;  ///< as ROS 1 writes it: "sensor_msgs/PointCloud2"
  /// How its messages are stored.
  Serialization serialization = Serialization::kOther;
  std::uint64_t message_count = 0;  ///< as far as known where the type is not one that is read
};

/// Where a message lies.
struct MessagePlace {
  std::int64_t log_time_ns = 0;  ///< when it was recorded
  std::uint64_t offset = 0;      ///< within its block, or its row
  std::uint32_t block = 0;       ///< chunk within the file
  std::uint32_t file = 0;        ///< of a recording in several files
};

/// A recording whose messages are indexed when it is opened and read when they are asked for.
///
/// Memory: 24 bytes for every message of a type that `kind_of` knows, and a few decompressed
/// blocks. Reading throws DatasetError naming the file; not for several threads at a time.
class MessageSource {
 public:
  MessageSource() = default;
  virtual ~MessageSource() = default;
  MessageSource(const MessageSource&) = delete;
  MessageSource& operator=(const MessageSource&) = delete;

  /// All topics, in the order of their first mention.
  [[nodiscard]] const std::vector<Topic>& topics() const { return topics_; }
  /// Messages of a topic in order of log time; empty where its type is not one that is read.
  [[nodiscard]] const std::vector<MessagePlace>& messages(std::size_t topic) const {
    return places_.at(topic);
  }
  /// The first `limit` bytes of a message. Valid until the next call.
  virtual std::string_view read(const MessagePlace& place, std::size_t limit = SIZE_MAX) = 0;

  /// What was wrong with the files and how it was dealt with, one sentence each.
  [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }

 protected:
  /// Index of the topic of that name, type and serialization; adds it if there is none.
  std::size_t add_topic(std::string_view name, std::string_view type, Serialization serialization);
  /// True if messages of the topic are of a kind that is read.
  [[nodiscard]] bool is_read(std::size_t topic) const { return is_read_.at(topic); }
  /// Counts a message, and keeps where it lies if its kind is read.
  void add_message(std::size_t topic, const MessagePlace& place);
  /// Counts messages of a kind that is not read.
  void count_messages(std::size_t topic, std::uint64_t count);
  /// Adds to what `warnings` returns.
  void warn(std::string text) { warnings_.push_back(std::move(text)); }
  /// Forgets topics and messages.
  void clear();
  /// Sorts the messages by log time. To be called once all are added.
  void finish();

 private:
  std::vector<Topic> topics_;
  std::map<std::tuple<std::string, std::string, Serialization>, std::size_t> topic_numbers_;
  std::vector<std::vector<MessagePlace>> places_;
  std::vector<bool> is_read_;
  std::vector<std::string> warnings_;
};

/// Calls `visit(topic, number)` for every message of `topics`, in order of log time; `number`
/// counts within the topic.
void for_each_message(const MessageSource& source, std::span<const std::size_t> topics,
                      const std::function<void(std::size_t topic, std::size_t number)>& visit);

/// Open one file. Throw DatasetError.
std::unique_ptr<MessageSource> open_mcap(const std::filesystem::path& file);
std::unique_ptr<MessageSource> open_ros1_bag(const std::filesystem::path& file);
std::unique_ptr<MessageSource> open_sqlite_bag(const std::filesystem::path& file);

/// True if `path` is a bag, or a folder with bags in it.
bool holds_messages(const std::filesystem::path& path);

/// Opens a bag of any format, or a folder that holds one in one or several files. Throws
/// DatasetError.
std::unique_ptr<MessageSource> open_messages(const std::filesystem::path& path);

}  // namespace unimapper::datasets::bag
