#include "ports/datasets/bag/mcap_records.hpp"

#include <string>

namespace unimapper::datasets::bag {

McapFooter parse_mcap_footer(std::string_view content) {
  RecordReader reader(content);
  McapFooter footer;
  footer.summary_start = reader.number<std::uint64_t>();
  reader.take(sizeof(std::uint64_t));  // start of the summary offsets
  footer.summary_crc = reader.number<std::uint32_t>();
  return footer;
}

McapSchema parse_mcap_schema(std::string_view content) {
  RecordReader reader(content);
  McapSchema schema;
  schema.id = reader.number<std::uint16_t>();
  schema.name = reader.text();
  return schema;
}

McapChannel parse_mcap_channel(std::string_view content) {
  RecordReader reader(content);
  McapChannel channel;
  channel.id = reader.number<std::uint16_t>();
  channel.schema = reader.number<std::uint16_t>();
  channel.topic = reader.text();
  channel.message_encoding = reader.text();
  return channel;
}

McapMessage parse_mcap_message(std::string_view content) {
  RecordReader reader(content);
  McapMessage message;
  message.channel = reader.number<std::uint16_t>();
  reader.take(sizeof(std::uint32_t));  // sequence
  message.log_time_ns = static_cast<std::int64_t>(reader.number<std::uint64_t>());
  reader.take(sizeof(std::uint64_t));  // publish time
  message.data = reader.take(reader.left());
  return message;
}

McapChunkHead parse_mcap_chunk_head(std::string_view content) {
  RecordReader reader(content);
  McapChunkHead chunk;
  reader.take(2 * sizeof(std::uint64_t));  // times of the first and the last message
  chunk.uncompressed_bytes = reader.number<std::uint64_t>();
  chunk.uncompressed_crc = reader.number<std::uint32_t>();
  chunk.compression = reader.text();
  chunk.packed_bytes = reader.number<std::uint64_t>();
  chunk.head_bytes = reader.position();
  return chunk;
}

McapChunkIndex parse_mcap_chunk_index(std::string_view content) {
  RecordReader reader(content);
  McapChunkIndex index;
  reader.take(2 * sizeof(std::uint64_t));  // times of the first and the last message
  index.chunk_start = reader.number<std::uint64_t>();
  index.chunk_bytes = reader.number<std::uint64_t>();
  reader.text();  // offsets of the message indexes by channel
  index.message_index_bytes = reader.number<std::uint64_t>();
  return index;
}

Compression parse_mcap_compression(std::string_view name) {
  if (name.empty()) return Compression::kNone;
  if (name == "lz4") return Compression::kLz4;
  if (name == "zstd") return Compression::kZstd;
  throw DatasetError("unknown compression '" + std::string(name) + "'; lz4 and zstd are read");
}

}  // namespace unimapper::datasets::bag
