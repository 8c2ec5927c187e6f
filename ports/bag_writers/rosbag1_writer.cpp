// Recordings of ROS 1 messages as bag files, format version 2.0.
#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "ports/bag_writers/byte_buffer.hpp"
#include "ports/bag_writers/containers.hpp"
#include "ports/bag_writers/message_definitions.hpp"
#include "ports/bag_writers/output_file.hpp"

namespace unimapper::bags {
namespace {

constexpr std::string_view kVersion = "#ROSBAG V2.0\n";
/// The first record is padded, so that it can be rewritten once the index's place is known.
constexpr std::size_t kFirstRecordBytes = 4096;
constexpr std::size_t kChunkBytes = 768 * 1024;

enum Operation : std::uint8_t {
  kMessageData = 0x02,
  kBagHeader = 0x03,
  kIndex = 0x04,
  kChunkOfMessages = 0x05,
  kChunkInfo = 0x06,
  kConnection = 0x07,
};

/// Header of a record: fields NAME=VALUE, each with its length.
class Fields {
 public:
  explicit Fields(Operation operation) { add("op", operation); }
  Fields() = default;

  void add_text(std::string_view name, std::string_view value) {
    const std::size_t begin = bytes_.begin_length<std::uint32_t>();
    bytes_.put_bytes(name);
    bytes_.put('=');
    bytes_.put_bytes(value);
    bytes_.end_length<std::uint32_t>(begin);
  }
  template <typename Number>
  void add(std::string_view name, Number value) {
    ByteBuffer number;
    number.put(value);
    add_text(name, number.view());
  }
  [[nodiscard]] std::string_view view() const { return bytes_.view(); }

 private:
  ByteBuffer bytes_;
};

void put_record(ByteBuffer& bytes, const Fields& header, std::string_view data) {
  bytes.put_text(header.view());
  bytes.put_text(data);
}

/// Seconds and nanoseconds as ROS 1 lays them out.
std::uint64_t ros_time(std::int64_t stamp_ns) {
  constexpr std::int64_t kPerSecond = 1'000'000'000;
  const auto seconds = static_cast<std::uint64_t>(stamp_ns / kPerSecond);
  const auto nanoseconds = static_cast<std::uint64_t>(stamp_ns % kPerSecond);
  return seconds | nanoseconds << 32U;
}

class Rosbag1 : public BagWriter {
 public:
  explicit Rosbag1(const std::filesystem::path& file) : BagWriter(Encoding::kRos1), file_(file) {
    file_.write(kVersion);
    file_.write(first_record(0));
  }

  std::size_t add_topic(const Topic& topic) override {
    const auto id = static_cast<std::uint32_t>(topics_++);
    Fields header(kConnection);
    header.add("conn", id);
    header.add_text("topic", topic.name);
    Fields data;
    data.add_text("topic", topic.name);
    data.add_text("type", ros1_name(topic.type));
    data.add_text("md5sum", ros1_md5(topic.type));
    data.add_text("message_definition", ros1_definition(topic.type));
    if (topic.is_latched) data.add_text("latching", "1");
    put_record(chunk_, header, data.view());
    put_record(connections_, header, data.view());
    return id;
  }

  void close() override {
    write_chunk();
    const std::uint64_t index_position = file_.offset();
    file_.write(connections_.view());
    file_.write(chunk_infos_.view());
    file_.overwrite(kVersion.size(), first_record(index_position));
    file_.close();
  }

 protected:
  void write_bytes(std::size_t topic, std::int64_t stamp_ns, std::string_view message) override {
    Fields header(kMessageData);
    header.add("conn", static_cast<std::uint32_t>(topic));
    header.add("time", ros_time(stamp_ns));
    ByteBuffer& entries = entries_[static_cast<std::uint32_t>(topic)];
    entries.put(ros_time(stamp_ns));
    entries.put(static_cast<std::uint32_t>(chunk_.size()));
    put_record(chunk_, header, message);
    first_ns_ = std::min(first_ns_, stamp_ns);
    last_ns_ = std::max(last_ns_, stamp_ns);
    if (chunk_.size() >= kChunkBytes) write_chunk();
  }

 private:
  static constexpr std::size_t kEntryBytes = 12;

  [[nodiscard]] std::string first_record(std::uint64_t index_position) const {
    Fields header(kBagHeader);
    header.add("index_pos", index_position);
    header.add("conn_count", static_cast<std::uint32_t>(topics_));
    header.add("chunk_count", chunks_);
    ByteBuffer bytes;
    put_record(bytes, header, std::string(kFirstRecordBytes - header.view().size(), ' '));
    return std::string(bytes.view());
  }

  void write_chunk() {
    if (chunk_.empty()) return;
    const std::uint64_t position = file_.offset();
    Fields header(kChunkOfMessages);
    header.add_text("compression", "none");
    header.add("size", static_cast<std::uint32_t>(chunk_.size()));
    ByteBuffer bytes;
    put_record(bytes, header, chunk_.view());
    ByteBuffer counts;
    for (const auto& [topic, entries] : entries_) {
      const auto count = static_cast<std::uint32_t>(entries.size() / kEntryBytes);
      Fields index(kIndex);
      index.add("ver", std::uint32_t{1});
      index.add("conn", topic);
      index.add("count", count);
      put_record(bytes, index, entries.view());
      counts.put(topic);
      counts.put(count);
    }
    file_.write(bytes.view());

    Fields info(kChunkInfo);
    info.add("ver", std::uint32_t{1});
    info.add("chunk_pos", position);
    info.add("start_time", ros_time(entries_.empty() ? 0 : first_ns_));
    info.add("end_time", ros_time(entries_.empty() ? 0 : last_ns_));
    info.add("count", static_cast<std::uint32_t>(entries_.size()));
    put_record(chunk_infos_, info, counts.view());
    ++chunks_;
    chunk_.clear();
    entries_.clear();
    first_ns_ = INT64_MAX;
    last_ns_ = INT64_MIN;
  }

  OutputFile file_;
  std::size_t topics_ = 0;
  std::uint32_t chunks_ = 0;
  ByteBuffer connections_, chunk_infos_;
  // The open chunk: records, where each topic's messages lie in it, and when they were recorded.
  ByteBuffer chunk_;
  std::map<std::uint32_t, ByteBuffer> entries_;
  std::int64_t first_ns_ = INT64_MAX, last_ns_ = INT64_MIN;
};

}  // namespace

std::unique_ptr<BagWriter> create_rosbag1(const std::filesystem::path& file) {
  return std::make_unique<Rosbag1>(file);
}

}  // namespace unimapper::bags
