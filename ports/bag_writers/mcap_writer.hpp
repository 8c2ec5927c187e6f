// MCAP file writer: chunks, message index, statistics, summary, checksums.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "ports/bag_writers/byte_buffer.hpp"
#include "ports/bag_writers/output_file.hpp"

namespace unimapper::bags {

/// Writes one MCAP file (version 0, https://mcap.dev/spec). Messages are gathered in chunks, and
/// the file ends with an index of them. All members throw BagError.
class McapWriter {
 public:
  /// `profile`: "ros2", or empty. A chunk is closed once it holds `chunk_bytes`.
  McapWriter(const std::filesystem::path& file, std::string_view profile,
             std::size_t chunk_bytes = std::size_t{1} << 20U);

  /// Adds what messages look like; returns its number.
  std::uint16_t add_schema(std::string_view name, std::string_view encoding, std::string_view data);
  /// Adds a stream of messages of a schema; returns its number.
  std::uint16_t add_channel(std::uint16_t schema, std::string_view topic,
                            std::string_view message_encoding,
                            const std::map<std::string, std::string>& metadata = {});
  /// Writes a message of a channel, published when it was recorded.
  void write(std::uint16_t channel, std::uint64_t log_time_ns, std::string_view message);
  /// Writes index and summary. Must be the last call.
  void close();

 private:
  /// First and last time of the messages of a chunk or file; zero without any.
  struct Extent {
    std::uint64_t messages = 0, first_ns = 0, last_ns = 0;
    void include(std::uint64_t time_ns);
  };
  struct IndexEntry {
    std::uint64_t time_ns, offset;
  };

  void write_chunk();
  /// Writes what `gathered` holds into the file as records of one kind; remembers where they lie.
  void write_group(std::uint8_t opcode, const ByteBuffer& gathered, ByteBuffer& offsets);

  OutputFile file_;
  std::size_t chunk_bytes_;
  ByteBuffer records_;                                        // of the open chunk
  Extent chunk_;                                              // of the open chunk
  std::map<std::uint16_t, std::vector<IndexEntry>> entries_;  // of the open chunk, by channel
  Extent all_;
  std::map<std::uint16_t, std::uint64_t> counts_;  // messages of each channel
  std::uint32_t chunks_ = 0;
  std::uint16_t schemas_ = 0;
  // Records of the summary.
  ByteBuffer schema_records_, channel_records_, chunk_indexes_;
};

}  // namespace unimapper::bags
