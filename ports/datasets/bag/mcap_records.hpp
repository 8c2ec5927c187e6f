// Records of MCAP files.
//
// Every record is an opcode, the length of its content in eight bytes, and its content.
// Source: MCAP Format Specification, major version 0.
#pragma once

#include <cstdint>
#include <string_view>

#include "ports/datasets/bag/decompress.hpp"
#include "ports/datasets/bag/record_reader.hpp"

namespace unimapper::datasets::bag {

/// Magic bytes at both ends of a file.
inline constexpr std::string_view kMcapMagic = "\x89MCAP0\r\n";
/// Opcode and length in front of a record's content.
inline constexpr std::uint64_t kMcapRecordHeadBytes = 9;
/// Footer with its head.
inline constexpr std::uint64_t kMcapFooterBytes = kMcapRecordHeadBytes + 20;

/// Kinds of records that are read.
enum class McapOpcode : std::uint8_t {
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kDataEnd = 0x0F,
};

/// One record.
struct McapRecord {
  McapOpcode opcode;         ///< may be none of the above
  std::string_view content;  ///< as long as the record states
};

/// The summary's place and checksum.
struct McapFooter {
  std::uint64_t summary_start = 0;  ///< 0: there is no summary
  std::uint32_t summary_crc = 0;    ///< 0: not calculated
};

/// Name of a message type.
struct McapSchema {
  std::uint16_t id = 0;   ///< never 0
  std::string_view name;  ///< e.g. "sensor_msgs/msg/PointCloud2"
};

/// Messages of one schema on one topic.
struct McapChannel {
  /// As messages name the channel.
  std::uint16_t id = 0;
  std::uint16_t schema = 0;  ///< 0: none
  /// Name of the topic.
  std::string_view topic;
  std::string_view message_encoding;  ///< e.g. "cdr"
};

/// Content of a message record.
struct McapMessage {
  /// `McapChannel::id`.
  std::uint16_t channel = 0;
  /// Time of recording, nanoseconds.
  std::int64_t log_time_ns = 0;
  /// The serialised message.
  std::string_view data;
};

/// Content of a chunk up to its records.
struct McapChunkHead {
  /// Bytes of the records once decompressed, as the file states.
  std::uint64_t uncompressed_bytes = 0;
  std::uint32_t uncompressed_crc = 0;  ///< 0: not calculated
  std::string_view compression;        ///< empty, "lz4" or "zstd"
  std::uint64_t packed_bytes = 0;      ///< of the records, which follow
  std::uint64_t head_bytes = 0;        ///< of the content in front of them
};

/// Where a chunk and its message index lie in the file.
struct McapChunkIndex {
  std::uint64_t chunk_start = 0;          ///< of the chunk's record
  std::uint64_t chunk_bytes = 0;          ///< with its head
  std::uint64_t message_index_bytes = 0;  ///< records behind the chunk; 0: not indexed
};

/// All parsers take a record's content, and throw DatasetError where it is too short.
McapFooter parse_mcap_footer(std::string_view content);
McapSchema parse_mcap_schema(std::string_view content);
McapChannel parse_mcap_channel(std::string_view content);
McapMessage parse_mcap_message(std::string_view content);
/// `content` may end behind the head.
McapChunkHead parse_mcap_chunk_head(std::string_view content);
McapChunkIndex parse_mcap_chunk_index(std::string_view content);

/// Throws DatasetError at an unknown name.
Compression parse_mcap_compression(std::string_view name);

/// Calls `visit(record, offset of the record in bytes)` for every record. Throws DatasetError
/// where a record ends behind `bytes`.
template <typename Visit>
void for_each_mcap_record(std::string_view bytes, const Visit& visit) {
  RecordReader reader(bytes);
  while (reader.left() > 0) {
    const std::size_t offset = reader.position();
    const auto opcode = static_cast<McapOpcode>(reader.number<std::uint8_t>());
    visit(McapRecord{opcode, reader.take(reader.number<std::uint64_t>())}, offset);
  }
}

}  // namespace unimapper::datasets::bag
