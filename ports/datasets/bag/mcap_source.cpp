// MCAP files, by their index or, where it is missing or damaged, record by record.
#include <zlib.h>

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "ports/datasets/bag/block_cache.hpp"
#include "ports/datasets/bag/byte_file.hpp"
#include "ports/datasets/bag/mcap_records.hpp"
#include "ports/datasets/bag/message_source.hpp"
#include "ports/datasets/files.hpp"

namespace unimapper::datasets::bag {

namespace {

/// Messages outside of chunks lie in this block: offsets are those of the file.
constexpr std::uint32_t kOutsideChunks = UINT32_MAX;
/// A summary or message index that is longer is not taken into memory.
constexpr std::uint64_t kMaxIndexBytes = std::uint64_t{256} << 20;
/// A chunk's head is about 50 bytes long; a longer one names an unknown compression.
constexpr std::uint64_t kMaxChunkHeadBytes = 256;

std::uint32_t crc32_of(std::string_view bytes) {
  const auto* data = reinterpret_cast<const Bytef*>(bytes.data());
  return static_cast<std::uint32_t>(::crc32_z(0, data, bytes.size()));
}

class McapSource final : public MessageSource {
 public:
  explicit McapSource(const std::filesystem::path& path) : file_(path) {
    std::string buffer;
    const std::uint64_t magic_bytes = std::min<std::uint64_t>(kMcapMagic.size(), file_.size());
    if (file_.read(0, magic_bytes, buffer) != kMcapMagic) {
      fail(path, "is not an MCAP file: its first bytes differ");
    }
    if (!index_by_summary()) scan_file();
    finish();
  }

  std::string_view read(const MessagePlace& place, std::size_t limit) override {
    try {
      const std::string_view message =
          place.block == kOutsideChunks ? read_outside_chunks(place, limit) : read_in_chunk(place);
      return message.substr(0, limit);
    } catch (const DatasetError& error) {
      fail(file_.path(),
           "message at " + std::to_string(place.log_time_ns) + " ns: " + error.what());
    }
  }

 private:
  struct Chunk {
    std::uint64_t content_start;  ///< in the file
    std::uint64_t content_bytes;
  };
  /// What a walk through records knows of a channel.
  struct KnownChannel {
    std::size_t topic = 0;
    std::uint64_t messages = 0;
  };

  // --- By the summary

  /// False if there is none that can be trusted.
  bool index_by_summary() {
    try {
      const auto summary = read_summary();
      if (!summary) return false;
      index_summary(*summary);
      return true;
    } catch (const DatasetError& error) {
      start_again();
      warn(std::string("the index is damaged (") + error.what() + "): every message is looked for");
      return false;
    }
  }

  /// Empty if the file ends without one.
  std::optional<std::string> read_summary() {
    const std::uint64_t end_bytes = kMcapFooterBytes + kMcapMagic.size();
    if (file_.size() < kMcapMagic.size() + end_bytes) return std::nullopt;
    const std::uint64_t footer_start = file_.size() - end_bytes;
    std::string buffer;
    const std::string end(file_.read(footer_start, end_bytes, buffer));
    if (!end.ends_with(kMcapMagic) ||
        static_cast<McapOpcode>(static_cast<std::uint8_t>(end[0])) != McapOpcode::kFooter) {
      return std::nullopt;
    }
    is_whole_ = true;
    const McapFooter footer = parse_mcap_footer(std::string_view(end).substr(kMcapRecordHeadBytes));
    if (footer.summary_start == 0) return std::nullopt;
    if (footer.summary_start > footer_start ||
        footer_start - footer.summary_start > kMaxIndexBytes) {
      throw DatasetError("the summary cannot begin at " + std::to_string(footer.summary_start));
    }
    std::string summary;
    (void)file_.read(footer.summary_start, footer_start - footer.summary_start, summary);
    if (footer.summary_crc != 0) {
      // The checksum goes up to the checksum.
      const std::size_t without_crc = kMcapFooterBytes - sizeof footer.summary_crc;
      if (crc32_of(summary + end.substr(0, without_crc)) != footer.summary_crc) {
        throw DatasetError("the summary's checksum is wrong");
      }
    }
    return summary;
  }

  void index_summary(const std::string& summary) {
    // Grouped by kind, in any order: schemas may follow the channels that name them.
    for_each_mcap_record(summary, [&](const McapRecord& record, std::size_t /*offset*/) {
      if (record.opcode == McapOpcode::kSchema) take_description(record);
    });
    std::vector<McapChunkIndex> chunks;
    std::optional<std::string_view> statistics;
    for_each_mcap_record(summary, [&](const McapRecord& record, std::size_t /*offset*/) {
      if (record.opcode == McapOpcode::kChunkIndex) {
        chunks.push_back(parse_mcap_chunk_index(record.content));
      } else if (record.opcode == McapOpcode::kStatistics) {
        statistics = record.content;
      } else {
        take_description(record);
      }
    });
    std::string buffer;
    for (const McapChunkIndex& chunk : chunks) index_chunk(chunk, buffer);
    if (!statistics) {
      // Messages outside of chunks are in no index.
      if (chunks.empty()) throw DatasetError("no statistics");
      return;
    }
    check_statistics(*statistics);
  }

  void index_chunk(const McapChunkIndex& index, std::string& buffer) {
    if (index.chunk_bytes < kMcapRecordHeadBytes || index.chunk_start > file_.size() ||
        index.chunk_bytes > file_.size() - index.chunk_start) {
      throw DatasetError("chunk outside of the file");
    }
    // Chunks that share their bytes would fill the memory.
    indexed_bytes_ += index.chunk_bytes;
    indexed_bytes_ += std::min(index.message_index_bytes, file_.size());
    if (indexed_bytes_ > file_.size()) throw DatasetError("chunks overlap");
    const std::uint32_t number = add_chunk(index.chunk_start + kMcapRecordHeadBytes,
                                           index.chunk_bytes - kMcapRecordHeadBytes);
    if (index.message_index_bytes == 0) {
      scan_chunk(number);
      return;
    }
    if (index.message_index_bytes > kMaxIndexBytes) throw DatasetError("index too long");
    const std::string_view records =
        file_.read(index.chunk_start + index.chunk_bytes, index.message_index_bytes, buffer);
    for_each_mcap_record(records, [&](const McapRecord& record, std::size_t /*offset*/) {
      if (record.opcode == McapOpcode::kMessageIndex) index_messages(record.content, number);
    });
  }

  void index_messages(std::string_view content, std::uint32_t chunk) {
    RecordReader reader(content);
    KnownChannel& channel = channels_at(reader.number<std::uint16_t>());
    RecordReader entries(reader.text());
    while (entries.left() > 0) {
      MessagePlace place;
      place.log_time_ns = static_cast<std::int64_t>(entries.number<std::uint64_t>());
      place.offset = entries.number<std::uint64_t>();
      place.block = chunk;
      add_message(channel.topic, place);
      ++channel.messages;
    }
  }

  /// Throws where the index has not as many messages of a channel as the statistics.
  void check_statistics(std::string_view content) {
    RecordReader reader(content);
    const auto message_count = reader.number<std::uint64_t>();
    // Counts of schemas, channels, attachments, metadata and chunks; times of the first and the
    // last message.
    reader.take(2 + 4 + 4 + 4 + 4 + 8 + 8);
    RecordReader counts(reader.text());
    std::uint64_t indexed = 0;
    for (const auto& [id, channel] : channels_) indexed += channel.messages;
    while (counts.left() > 0) {
      const auto id = counts.number<std::uint16_t>();
      const auto count = counts.number<std::uint64_t>();
      const auto known = channels_.find(id);
      if (known == channels_.end() || known->second.messages != count) {
        throw DatasetError("channel " + std::to_string(id) + " has other messages than counted");
      }
    }
    if (indexed != message_count) throw DatasetError("not every message is in it");
  }

  // --- Record by record

  void scan_file() {
    std::uint64_t at = kMcapMagic.size();
    std::string buffer;
    bool has_ended = false;
    while (!has_ended && at + kMcapRecordHeadBytes <= file_.size()) {
      RecordReader head(file_.read(at, kMcapRecordHeadBytes, buffer));
      const auto opcode = static_cast<McapOpcode>(head.number<std::uint8_t>());
      const auto bytes = head.number<std::uint64_t>();
      const std::uint64_t content = at + kMcapRecordHeadBytes;
      // No recorder writes opcode 0: a hole in the file.
      if (bytes > file_.size() - content || static_cast<std::uint8_t>(opcode) == 0) break;
      has_ended = opcode == McapOpcode::kDataEnd || opcode == McapOpcode::kFooter;
      try {
        scan_record(opcode, at, bytes, buffer);
      } catch (const DatasetError& error) {
        if (damaged_records_++ == 0) first_damage_ = error.what();
      }
      at = content + bytes;
    }
    if (!has_ended) {
      warn("the file is torn after " + std::to_string(at) + " of " + std::to_string(file_.size()) +
           " bytes: what lies before is read");
    } else if (!is_whole_) {
      warn("the end of the file is missing: all its messages are read");
    }
    if (damaged_records_ > 0) {
      warn(std::to_string(damaged_records_) + " chunks or records (of " +
           std::to_string(chunks_.size()) +
           " chunks) are damaged and left out from the damage on; the first: " + first_damage_);
    }
  }

  void scan_record(McapOpcode opcode, std::uint64_t start, std::uint64_t bytes,
                   std::string& buffer) {
    const std::uint64_t content = start + kMcapRecordHeadBytes;
    if (opcode == McapOpcode::kChunk) {
      scan_chunk(add_chunk(content, bytes));
    } else if (opcode == McapOpcode::kMessage) {
      constexpr std::uint64_t kHeadBytes = 2 + 4 + 8 + 8;
      const McapMessage message =
          parse_mcap_message(file_.read(content, std::min(bytes, kHeadBytes), buffer));
      take_message(message, {message.log_time_ns, start, kOutsideChunks, 0});
    } else if (opcode == McapOpcode::kSchema || opcode == McapOpcode::kChannel) {
      if (bytes > kMaxBlockBytes) throw DatasetError("description too long");
      take_description({opcode, file_.read(content, bytes, buffer)});
    }
  }

  /// Takes the messages of a chunk up to the first damage, which throws.
  void scan_chunk(std::uint32_t number) {
    const std::string records = unpack(number);
    for_each_mcap_record(records, [&](const McapRecord& record, std::size_t offset) {
      if (record.opcode == McapOpcode::kMessage) {
        const McapMessage message = parse_mcap_message(record.content);
        take_message(message, {message.log_time_ns, offset, number, 0});
      } else {
        take_description(record);
      }
    });
  }

  // --- Both

  void start_again() {
    clear();
    chunks_.clear();
    schemas_.clear();
    channels_.clear();
  }

  std::uint32_t add_chunk(std::uint64_t content_start, std::uint64_t content_bytes) {
    chunks_.push_back({content_start, content_bytes});
    return static_cast<std::uint32_t>(chunks_.size() - 1);
  }

  /// Schemas and channels; other records are passed over.
  void take_description(const McapRecord& record) {
    if (record.opcode == McapOpcode::kSchema) {
      const McapSchema schema = parse_mcap_schema(record.content);
      if (schema.id != 0) schemas_[schema.id] = std::string(schema.name);
    } else if (record.opcode == McapOpcode::kChannel) {
      const McapChannel channel = parse_mcap_channel(record.content);
      if (channels_.contains(channel.id)) return;
      const std::size_t topic = add_topic(channel.topic, schemas_[channel.schema],
                                          parse_serialization(channel.message_encoding));
      channels_[channel.id] = {topic, 0};
    }
  }

  void take_message(const McapMessage& message, const MessagePlace& place) {
    KnownChannel& channel = channels_at(message.channel);
    add_message(channel.topic, place);
    ++channel.messages;
  }

  KnownChannel& channels_at(std::uint16_t id) {
    const auto channel = channels_.find(id);
    if (channel == channels_.end()) {
      throw DatasetError("message of the unknown channel " + std::to_string(id));
    }
    return channel->second;
  }

  /// The records of a chunk.
  std::string unpack(std::uint32_t number) const {
    const Chunk& chunk = chunks_.at(number);
    std::string buffer;
    McapChunkHead head = parse_mcap_chunk_head(
        file_.read(chunk.content_start, std::min(chunk.content_bytes, kMaxChunkHeadBytes), buffer));
    const Compression compression = parse_mcap_compression(head.compression);
    if (head.packed_bytes > chunk.content_bytes - head.head_bytes) {
      throw DatasetError("chunk with more records than it has bytes");
    }
    const std::string_view packed =
        file_.read(chunk.content_start + head.head_bytes, head.packed_bytes, buffer);
    std::string records = decompress(packed, compression, head.uncompressed_bytes);
    if (head.uncompressed_crc != 0 && crc32_of(records) != head.uncompressed_crc) {
      throw DatasetError("chunk with a wrong checksum");
    }
    return records;
  }

  std::string_view read_in_chunk(const MessagePlace& place) {
    const std::string& records = cache_.get(place.block, [&] { return unpack(place.block); });
    if (place.offset > records.size()) throw DatasetError("lies outside of its chunk");
    RecordReader reader(std::string_view(records).substr(static_cast<std::size_t>(place.offset)));
    const auto opcode = static_cast<McapOpcode>(reader.number<std::uint8_t>());
    if (opcode != McapOpcode::kMessage) throw DatasetError("the index points elsewhere");
    return parse_mcap_message(reader.take(reader.number<std::uint64_t>())).data;
  }

  std::string_view read_outside_chunks(const MessagePlace& place, std::size_t limit) {
    constexpr std::uint64_t kHeadBytes = 2 + 4 + 8 + 8;
    RecordReader head(file_.read(place.offset + 1, sizeof(std::uint64_t), message_));
    const auto bytes = head.number<std::uint64_t>();
    const std::uint64_t wanted = std::min<std::uint64_t>(limit, bytes - kHeadBytes) + kHeadBytes;
    if (wanted > kMaxBlockBytes) throw DatasetError("is too long");
    return parse_mcap_message(file_.read(place.offset + kMcapRecordHeadBytes, wanted, message_))
        .data;
  }

  ByteFile file_;
  bool is_whole_ = false;
  std::vector<Chunk> chunks_;
  std::uint64_t indexed_bytes_ = 0;
  std::map<std::uint16_t, std::string> schemas_;
  std::map<std::uint16_t, KnownChannel> channels_;
  std::size_t damaged_records_ = 0;
  std::string first_damage_;
  BlockCache cache_;
  std::string message_;
};

}  // namespace

std::unique_ptr<MessageSource> open_mcap(const std::filesystem::path& file) {
  return std::make_unique<McapSource>(file);
}

}  // namespace unimapper::datasets::bag
