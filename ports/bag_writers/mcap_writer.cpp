#include "ports/bag_writers/mcap_writer.hpp"

#include <algorithm>

namespace unimapper::bags {
namespace {

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);

enum Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

/// Appends a record whose content `fill` writes.
template <typename Fill>
void put_record(ByteBuffer& bytes, Opcode opcode, const Fill& fill) {
  bytes.put(opcode);
  const std::size_t begin = bytes.begin_length<std::uint64_t>();
  fill(bytes);
  bytes.end_length<std::uint64_t>(begin);
}

}  // namespace

void McapWriter::Extent::include(std::uint64_t time_ns) {
  first_ns = messages == 0 ? time_ns : std::min(first_ns, time_ns);
  last_ns = std::max(last_ns, time_ns);
  ++messages;
}

McapWriter::McapWriter(const std::filesystem::path& file, std::string_view profile,
                       std::size_t chunk_bytes)
    : file_(file), chunk_bytes_(chunk_bytes) {
  ByteBuffer bytes;
  bytes.put_bytes(kMagic);
  put_record(bytes, kHeader, [&](ByteBuffer& record) {
    record.put_text(profile);
    record.put_text("unimapper");
  });
  file_.write(bytes.view());
}

std::uint16_t McapWriter::add_schema(std::string_view name, std::string_view encoding,
                                     std::string_view data) {
  const std::uint16_t id = ++schemas_;  // zero means none
  const auto fill = [&](ByteBuffer& record) {
    record.put(id);
    record.put_text(name);
    record.put_text(encoding);
    record.put_text(data);
  };
  put_record(records_, kSchema, fill);
  put_record(schema_records_, kSchema, fill);
  return id;
}

std::uint16_t McapWriter::add_channel(std::uint16_t schema, std::string_view topic,
                                      std::string_view message_encoding,
                                      const std::map<std::string, std::string>& metadata) {
  const auto id = static_cast<std::uint16_t>(counts_.size());
  counts_[id] = 0;
  const auto fill = [&](ByteBuffer& record) {
    record.put(id);
    record.put(schema);
    record.put_text(topic);
    record.put_text(message_encoding);
    const std::size_t begin = record.begin_length<std::uint32_t>();
    for (const auto& [key, value] : metadata) {
      record.put_text(key);
      record.put_text(value);
    }
    record.end_length<std::uint32_t>(begin);
  };
  put_record(records_, kChannel, fill);
  put_record(channel_records_, kChannel, fill);
  return id;
}

void McapWriter::write(std::uint16_t channel, std::uint64_t log_time_ns, std::string_view message) {
  entries_[channel].push_back({log_time_ns, records_.size()});
  put_record(records_, kMessage, [&](ByteBuffer& record) {
    record.put(channel);
    record.put(static_cast<std::uint32_t>(counts_.at(channel)++));
    record.put(log_time_ns);
    record.put(log_time_ns);
    record.put_bytes(message);
  });
  chunk_.include(log_time_ns);
  all_.include(log_time_ns);
  if (records_.size() >= chunk_bytes_) write_chunk();
}

void McapWriter::write_chunk() {
  if (records_.empty()) return;
  constexpr std::string_view kCompression;
  const std::uint64_t chunk_begin = file_.offset();
  ByteBuffer chunk;
  put_record(chunk, kChunk, [&](ByteBuffer& record) {
    record.put(chunk_.first_ns);
    record.put(chunk_.last_ns);
    record.put(std::uint64_t{records_.size()});
    record.put(crc32(records_.view()));
    record.put_text(kCompression);
    record.put(std::uint64_t{records_.size()});
    record.put_bytes(records_.view());
  });
  file_.write(chunk.view());
  const std::uint64_t index_begin = file_.offset();
  std::map<std::uint16_t, std::uint64_t> index_offsets;
  for (const auto& [channel, entries] : entries_) {
    index_offsets[channel] = file_.offset();
    ByteBuffer index;
    put_record(index, kMessageIndex, [&, id = channel, &times = entries](ByteBuffer& record) {
      record.put(id);
      const std::size_t begin = record.begin_length<std::uint32_t>();
      for (const IndexEntry& entry : times) {
        record.put(entry.time_ns);
        record.put(entry.offset);
      }
      record.end_length<std::uint32_t>(begin);
    });
    file_.write(index.view());
  }
  put_record(chunk_indexes_, kChunkIndex, [&](ByteBuffer& record) {
    record.put(chunk_.first_ns);
    record.put(chunk_.last_ns);
    record.put(chunk_begin);
    record.put(std::uint64_t{chunk.size()});
    const std::size_t begin = record.begin_length<std::uint32_t>();
    for (const auto& [channel, offset] : index_offsets) {
      record.put(channel);
      record.put(offset);
    }
    record.end_length<std::uint32_t>(begin);
    record.put(file_.offset() - index_begin);
    record.put_text(kCompression);
    record.put(std::uint64_t{records_.size()});
    record.put(std::uint64_t{records_.size()});
  });
  ++chunks_;
  records_.clear();
  entries_.clear();
  chunk_ = {};
}

void McapWriter::write_group(std::uint8_t opcode, const ByteBuffer& gathered, ByteBuffer& offsets) {
  if (gathered.empty()) return;
  put_record(offsets, kSummaryOffset, [&](ByteBuffer& record) {
    record.put(opcode);
    record.put(file_.offset());
    record.put(std::uint64_t{gathered.size()});
  });
  file_.write(gathered.view());
}

void McapWriter::close() {
  write_chunk();
  ByteBuffer end;
  const std::uint32_t data_checksum = file_.checksum();
  put_record(end, kDataEnd, [&](ByteBuffer& record) { record.put(data_checksum); });
  file_.write(end.view());

  const std::uint64_t summary_begin = file_.offset();
  ByteBuffer statistics;
  put_record(statistics, kStatistics, [&](ByteBuffer& record) {
    record.put(all_.messages);
    record.put(schemas_);
    record.put(static_cast<std::uint32_t>(counts_.size()));
    record.put(std::uint32_t{0});  // attachments
    record.put(std::uint32_t{0});  // metadata records
    record.put(chunks_);
    record.put(all_.first_ns);
    record.put(all_.last_ns);
    const std::size_t begin = record.begin_length<std::uint32_t>();
    for (const auto& [channel, count] : counts_) {
      record.put(channel);
      record.put(count);
    }
    record.end_length<std::uint32_t>(begin);
  });
  file_.restart_checksum();
  ByteBuffer offsets;
  write_group(kSchema, schema_records_, offsets);
  write_group(kChannel, channel_records_, offsets);
  write_group(kStatistics, statistics, offsets);
  write_group(kChunkIndex, chunk_indexes_, offsets);
  const std::uint64_t offsets_begin = file_.offset();
  file_.write(offsets.view());

  // The checksum covers the footer's own beginning.
  ByteBuffer footer;
  footer.put(kFooter);
  footer.put(std::uint64_t{2 * sizeof(std::uint64_t) + sizeof(std::uint32_t)});
  footer.put(summary_begin);
  footer.put(offsets_begin);
  file_.write(footer.view());
  ByteBuffer end_of_file;
  end_of_file.put(file_.checksum());
  end_of_file.put_bytes(kMagic);
  file_.write(end_of_file.view());
  file_.close();
}

}  // namespace unimapper::bags
