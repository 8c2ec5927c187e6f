// Bags of ROS 1, by their index or, where it is missing or damaged, record by record.
//
// A record is the length of its header, the header, the length of its data, and the data; a header
// is a row of NAME=VALUE, each behind its length. Source: ROS bag format, version 2.0.
#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "ports/datasets/bag/block_cache.hpp"
#include "ports/datasets/bag/byte_file.hpp"
#include "ports/datasets/bag/decompress.hpp"
#include "ports/datasets/bag/message_source.hpp"
#include "ports/datasets/bag/record_reader.hpp"
#include "ports/datasets/files.hpp"
#include "ports/datasets/poses.hpp"

namespace unimapper::datasets::bag {

namespace {

constexpr std::string_view kRosBagMagic = "#ROSBAG V2.0\n";
/// Headers hold names and numbers; a longer one is none.
constexpr std::uint32_t kMaxHeaderBytes = 1U << 20;
/// A connection's data are names and the text of its message's definition.
constexpr std::uint32_t kMaxConnectionBytes = 1U << 24;
/// A chunk's list of places holds 12 bytes for a message.
constexpr std::uint32_t kMaxPlacesBytes = 1U << 28;

enum class BagOpcode : std::uint8_t {
  kMessage = 2,
  kFile = 3,
  kIndex = 4,
  kChunk = 5,
  kChunkInfo = 6,
  kConnection = 7,
};

/// The NAME=VALUE fields of a header; views into it.
class BagFields {
 public:
  explicit BagFields(std::string_view header) {
    RecordReader reader(header);
    while (reader.left() > 0) {
      const std::string_view field = reader.text();
      const std::size_t equals = field.find('=');
      if (equals == std::string_view::npos) throw DatasetError("header without NAME=VALUE");
      fields_[field.substr(0, equals)] = field.substr(equals + 1);
    }
  }

  [[nodiscard]] std::string_view text(std::string_view name) const {
    const auto field = fields_.find(name);
    if (field == fields_.end()) throw DatasetError("header without " + std::string(name));
    return field->second;
  }
  /// Empty where the field is missing.
  [[nodiscard]] std::string_view optional_text(std::string_view name) const {
    const auto field = fields_.find(name);
    return field == fields_.end() ? std::string_view() : field->second;
  }
  template <typename T>
  [[nodiscard]] T number(std::string_view name) const {
    return RecordReader(text(name)).number<T>();
  }
  [[nodiscard]] BagOpcode opcode() const { return BagOpcode{number<std::uint8_t>("op")}; }

 private:
  std::map<std::string_view, std::string_view> fields_;
};

/// Seconds and nanoseconds, four bytes each.
std::int64_t read_time_ns(RecordReader& reader) {
  const auto seconds = reader.number<std::uint32_t>();
  return std::int64_t{seconds} * kNanosecondsPerSecond + reader.number<std::uint32_t>();
}

Compression parse_bag_compression(std::string_view name) {
  if (name == "none") return Compression::kNone;
  if (name == "lz4") return Compression::kLz4;
  if (name == "bz2") return Compression::kBzip2;
  throw DatasetError("unknown compression '" + std::string(name) + "'");
}

class Ros1BagSource final : public MessageSource {
 public:
  explicit Ros1BagSource(const std::filesystem::path& path) : file_(path) {
    std::string magic;
    (void)file_.read(0, std::min<std::uint64_t>(kRosBagMagic.size(), file_.size()), magic);
    if (magic != kRosBagMagic) {
      fail(path, "is a bag of another version than 2.0: convert it with 'rosbag fix'");
    }
    if (!index_by_file()) scan_file();
    finish();
  }

  std::string_view read(const MessagePlace& place, std::size_t limit) override {
    try {
      const std::string& records = cache_.get(place.block, [&] { return unpack(place.block); });
      if (place.offset > records.size()) throw DatasetError("lies outside of its chunk");
      RecordReader reader(std::string_view(records).substr(static_cast<std::size_t>(place.offset)));
      if (BagFields(reader.text()).opcode() != BagOpcode::kMessage) {
        throw DatasetError("the index points elsewhere");
      }
      return reader.text().substr(0, limit);
    } catch (const DatasetError& error) {
      fail(file_.path(),
           "message at " + std::to_string(place.log_time_ns) + " ns: " + error.what());
    }
  }

 private:
  /// A record in the file: its header, and where its data lie.
  struct Record {
    std::string header;
    std::uint64_t data_start = 0;
    std::uint32_t data_bytes = 0;
    [[nodiscard]] std::uint64_t end() const { return data_start + data_bytes; }
  };
  struct Chunk {
    std::uint64_t start;
    std::uint32_t index_records;
  };

  Record record_at(std::uint64_t start) const {
    Record record;
    std::string buffer;
    const auto header_bytes = length_at(start, buffer);
    if (header_bytes > kMaxHeaderBytes) throw DatasetError("header too long");
    (void)file_.read(start + 4, header_bytes, record.header);
    record.data_bytes = length_at(start + 4 + header_bytes, buffer);
    record.data_start = start + 8 + header_bytes;
    if (record.end() > file_.size()) throw DatasetError("record ends behind the file");
    return record;
  }

  std::uint32_t length_at(std::uint64_t at, std::string& buffer) const {
    return RecordReader(file_.read(at, 4, buffer)).number<std::uint32_t>();
  }

  std::string data_of(const Record& record, std::uint32_t most) const {
    if (record.data_bytes > most) throw DatasetError("record too long");
    std::string data;
    (void)file_.read(record.data_start, record.data_bytes, data);
    return data;
  }

  // --- By the index

  /// False if there is none that can be trusted.
  bool index_by_file() {
    try {
      const Record head = record_at(kRosBagMagic.size());
      const BagFields fields(head.header);
      if (fields.opcode() != BagOpcode::kFile) throw DatasetError("no file header");
      if (!fields.optional_text("encryptor").empty()) {
        fail(file_.path(), "is encrypted: decrypt it with 'rosbag decrypt'");
      }
      const auto index_start = fields.number<std::uint64_t>("index_pos");
      if (index_start == 0) throw DatasetError("its recorder did not finish it");
      read_index(index_start, fields.number<std::uint32_t>("chunk_count"));
      return true;
    } catch (const DatasetError& error) {
      if (std::string(error.what()).starts_with(file_.path().string())) throw;
      clear();
      topic_of_.clear();
      chunks_.clear();
      warn(std::string("the index is missing or damaged (") + error.what() +
           "): every message is looked for");
      return false;
    }
  }

  void read_index(std::uint64_t start, std::uint32_t chunk_count) {
    for (std::uint64_t at = start; at < file_.size();) {
      const Record record = record_at(at);
      const BagFields fields(record.header);
      if (fields.opcode() == BagOpcode::kConnection) {
        add_connection(fields, data_of(record, kMaxConnectionBytes));
      } else if (fields.opcode() == BagOpcode::kChunkInfo) {
        chunks_.push_back(
            {fields.number<std::uint64_t>("chunk_pos"), fields.number<std::uint32_t>("count")});
      }
      at = record.end();
    }
    if (chunks_.size() != chunk_count) throw DatasetError("not every chunk is in it");
    for (std::uint32_t chunk = 0; chunk < chunks_.size(); ++chunk) read_places(chunk);
  }

  /// The records behind a chunk that say where its messages lie, one for each connection.
  void read_places(std::uint32_t chunk) {
    std::uint64_t at = record_at(chunks_[chunk].start).end();
    for (std::uint32_t i = 0; i < chunks_[chunk].index_records; ++i) {
      const Record record = record_at(at);
      const BagFields fields(record.header);
      if (fields.opcode() != BagOpcode::kIndex) throw DatasetError("chunk without places");
      const std::size_t topic = topic_of(fields.number<std::uint32_t>("conn"));
      const std::string data = data_of(record, kMaxPlacesBytes);
      // Chunks that share their places would fill the memory.
      if ((place_bytes_ += data.size()) > file_.size()) throw DatasetError("chunks overlap");
      RecordReader places(data);
      while (places.left() > 0) {
        MessagePlace place;
        place.log_time_ns = read_time_ns(places);
        place.offset = places.number<std::uint32_t>();
        place.block = chunk;
        add_message(topic, place);
      }
      at = record.end();
    }
  }

  // --- Record by record

  void scan_file() {
    std::uint64_t at = kRosBagMagic.size();
    try {
      while (at < file_.size()) {
        const Record record = record_at(at);
        scan_record(record, at);
        at = record.end();
      }
    } catch (const DatasetError& error) {
      warn("the file is torn or damaged after " + std::to_string(at) + " of " +
           std::to_string(file_.size()) + " bytes (" + error.what() +
           "): what lies before is read");
    }
    if (damaged_chunks_ > 0) {
      warn(std::to_string(damaged_chunks_) + " of " + std::to_string(chunks_.size()) +
           " chunks are damaged and left out from the damage on; the first: " + first_damage_);
    }
  }

  void scan_record(const Record& record, std::uint64_t start) {
    const BagFields fields(record.header);
    if (fields.opcode() == BagOpcode::kConnection) {
      add_connection(fields, data_of(record, kMaxConnectionBytes));
    } else if (fields.opcode() == BagOpcode::kChunk) {
      chunks_.push_back({start, 0});
      try {
        scan_chunk(static_cast<std::uint32_t>(chunks_.size() - 1));
      } catch (const DatasetError& error) {
        if (damaged_chunks_++ == 0) first_damage_ = error.what();
      }
    }
  }

  /// Takes the messages of a chunk up to the first damage, which throws.
  void scan_chunk(std::uint32_t chunk) {
    const std::string records = unpack(chunk);
    RecordReader reader(records);
    while (reader.left() > 0) {
      const std::size_t offset = reader.position();
      const BagFields fields(reader.text());
      const std::string_view data = reader.text();
      if (fields.opcode() == BagOpcode::kConnection) {
        add_connection(fields, data);
      } else if (fields.opcode() == BagOpcode::kMessage) {
        RecordReader time(fields.text("time"));
        add_message(topic_of(fields.number<std::uint32_t>("conn")),
                    {read_time_ns(time), offset, chunk, 0});
      }
    }
  }

  // --- Both

  void add_connection(const BagFields& fields, std::string_view data) {
    const auto connection = fields.number<std::uint32_t>("conn");
    if (topic_of_.contains(connection)) return;
    topic_of_[connection] =
        add_topic(fields.text("topic"), BagFields(data).text("type"), Serialization::kRos1);
  }

  [[nodiscard]] std::size_t topic_of(std::uint32_t connection) const {
    const auto topic = topic_of_.find(connection);
    if (topic == topic_of_.end()) {
      throw DatasetError("message of the unknown connection " + std::to_string(connection));
    }
    return topic->second;
  }

  /// The records of a chunk.
  [[nodiscard]] std::string unpack(std::uint32_t chunk) const {
    const Record record = record_at(chunks_.at(chunk).start);
    const BagFields fields(record.header);
    if (fields.opcode() != BagOpcode::kChunk) throw DatasetError("no chunk where one should be");
    if (record.data_bytes > kMaxBlockBytes) throw DatasetError("chunk too long");
    std::string packed;
    (void)file_.read(record.data_start, record.data_bytes, packed);
    return decompress(packed, parse_bag_compression(fields.text("compression")),
                      fields.number<std::uint32_t>("size"));
  }

  ByteFile file_;
  std::map<std::uint32_t, std::size_t> topic_of_;
  std::vector<Chunk> chunks_;
  std::uint64_t place_bytes_ = 0;
  std::size_t damaged_chunks_ = 0;
  std::string first_damage_;
  BlockCache cache_;
};

}  // namespace

std::unique_ptr<MessageSource> open_ros1_bag(const std::filesystem::path& file) {
  return std::make_unique<Ros1BagSource>(file);
}

}  // namespace unimapper::datasets::bag
