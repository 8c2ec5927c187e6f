// Tests of the MCAP writer, against the layout of the specification.
#include "ports/bag_writers/mcap_writer.hpp"

#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "tests/ports/bag_writers/bytes.hpp"
#include "tests/temporary_directory.hpp"

using namespace unimapper;
using namespace unimapper::bags;

namespace {

struct Record {
  std::uint8_t opcode;
  std::size_t offset;  ///< of its opcode
  std::string_view content;
};

/// Records one after the other, to the end of `bytes`.
std::vector<Record> records(std::string_view bytes, std::size_t first = 0) {
  std::vector<Record> all;
  ByteReader reader(bytes);
  reader.take(first);
  while (!reader.at_end()) {
    const std::size_t offset = reader.offset();
    const auto opcode = reader.get<std::uint8_t>();
    const auto length = reader.get<std::uint64_t>();
    all.push_back({opcode, offset, reader.take(length)});
    if (all.back().content.size() != length) return {};
  }
  return all;
}

constexpr std::size_t kMagicBytes = 8;

/// Two channels and three messages, the last of them in a chunk of its own.
std::string example(const TemporaryDirectory& folder) {
  McapWriter writer(folder / "a.mcap", "ros2", 200);
  const std::uint16_t schema = writer.add_schema("Text", "ros2msg", "string text");
  const std::uint16_t one = writer.add_channel(schema, "/one", "cdr");
  const std::uint16_t two = writer.add_channel(schema, "/two", "cdr", {{"key", "value"}});
  writer.write(one, 300, "first");
  writer.write(two, 100, std::string(200, 'x'));
  writer.write(one, 400, "third");
  writer.close();
  return read_bytes(folder / "a.mcap");
}

std::string_view without_magic_at_end(const std::string& file) {
  return std::string_view(file).substr(0, file.size() - kMagicBytes);
}

}  // namespace

TEST_CASE("an MCAP file lies between magic bytes and ends with statistics and an index") {
  const TemporaryDirectory folder;
  const std::string file = example(folder);
  CHECK(file.substr(0, kMagicBytes) == "\x89MCAP0\r\n");
  CHECK(file.substr(file.size() - kMagicBytes) == "\x89MCAP0\r\n");
  std::vector<int> opcodes;
  for (const Record& record : records(without_magic_at_end(file), kMagicBytes)) {
    opcodes.push_back(record.opcode);
  }
  // Header; chunk, index of two channels; chunk, index of one; end of data; schema; two channels;
  // statistics; two chunk indexes; four summary offsets; footer.
  CHECK(opcodes == std::vector<int>{1, 6, 7, 7, 6, 7, 15, 3, 4, 4, 11, 8, 8, 14, 14, 14, 14, 2});
}

TEST_CASE("the checksums of an MCAP file cover its data, chunks and summary") {
  const TemporaryDirectory folder;
  const std::string file = example(folder);
  std::uint64_t summary_start = 0;
  std::size_t chunks = 0;
  for (const Record& record : records(without_magic_at_end(file), kMagicBytes)) {
    const std::string_view content = record.content;
    if (record.opcode == 0x0F) {
      CHECK(number_at<std::uint32_t>(content, 0) == slow_crc32(file.substr(0, record.offset)));
      summary_start = record.offset + 9 + content.size();
    }
    if (record.opcode == 0x06) {
      ++chunks;
      ByteReader chunk(content);
      chunk.take(16);
      const auto bytes = chunk.get<std::uint64_t>();
      const auto checksum = chunk.get<std::uint32_t>();
      CHECK(chunk.text().empty());
      CHECK(chunk.get<std::uint64_t>() == bytes);
      CHECK(slow_crc32(chunk.take(bytes)) == checksum);
      CHECK(chunk.at_end());
    }
    if (record.opcode == 0x02) {
      CHECK(number_at<std::uint64_t>(content, 0) == summary_start);
      const std::string covered = file.substr(summary_start, record.offset + 25 - summary_start);
      CHECK(number_at<std::uint32_t>(content, 16) == slow_crc32(covered));
    }
  }
  CHECK(chunks == 2);
}

TEST_CASE("the index of an MCAP file leads to every message") {
  const TemporaryDirectory folder;
  const std::string file = example(folder);
  std::vector<std::string> found;
  for (const Record& record : records(without_magic_at_end(file), kMagicBytes)) {
    if (record.opcode != 0x08) continue;
    ByteReader index(record.content);
    const auto first_ns = index.get<std::uint64_t>();
    const auto last_ns = index.get<std::uint64_t>();
    const auto chunk_offset = index.get<std::uint64_t>();
    const auto chunk_length = index.get<std::uint64_t>();
    CHECK(file.at(chunk_offset) == 0x06);
    CHECK(number_at<std::uint64_t>(file, chunk_offset + 1) + 9 == chunk_length);
    CHECK(number_at<std::uint64_t>(file, chunk_offset + 9) == first_ns);
    CHECK(number_at<std::uint64_t>(file, chunk_offset + 17) == last_ns);
    // Opcode and length, two times, size, checksum, compression, size.
    const std::size_t contents = chunk_offset + 9 + 16 + 8 + 4 + 4 + 8;
    std::uint64_t index_bytes = 0;
    ByteReader channels(index.text());
    while (!channels.at_end()) {
      const auto channel = channels.get<std::uint16_t>();
      const auto offset = channels.get<std::uint64_t>();
      const auto length = number_at<std::uint64_t>(file, offset + 1);
      index_bytes += 9 + length;
      CHECK(file.at(offset) == 0x07);
      ByteReader message_index(std::string_view(file).substr(offset + 9, length));
      CHECK(message_index.get<std::uint16_t>() == channel);
      ByteReader entries(message_index.text());
      while (!entries.at_end()) {
        const auto time_ns = entries.get<std::uint64_t>();
        const std::size_t message = contents + entries.get<std::uint64_t>();
        CHECK(file.at(message) == 0x05);
        CHECK(number_at<std::uint16_t>(file, message + 9) == channel);
        CHECK(number_at<std::uint64_t>(file, message + 15) == time_ns);
        const auto bytes = number_at<std::uint64_t>(file, message + 1) - 22;
        found.push_back(file.substr(message + 31, bytes));
      }
    }
    CHECK(index.get<std::uint64_t>() == index_bytes);
  }
  CHECK(found == std::vector<std::string>{"first", std::string(200, 'x'), "third"});
}

TEST_CASE("an MCAP file counts its messages") {
  const TemporaryDirectory folder;
  const std::string file = example(folder);
  for (const Record& record : records(without_magic_at_end(file), kMagicBytes)) {
    if (record.opcode != 0x0B) continue;
    ByteReader statistics(record.content);
    CHECK(statistics.get<std::uint64_t>() == 3);
    CHECK(statistics.get<std::uint16_t>() == 1);  // schemas
    CHECK(statistics.get<std::uint32_t>() == 2);  // channels
    CHECK(statistics.get<std::uint32_t>() == 0);  // attachments
    CHECK(statistics.get<std::uint32_t>() == 0);  // metadata
    CHECK(statistics.get<std::uint32_t>() == 2);  // chunks
    CHECK(statistics.get<std::uint64_t>() == 100);
    CHECK(statistics.get<std::uint64_t>() == 400);
    ByteReader counts(statistics.text());
    CHECK(counts.get<std::uint16_t>() == 0);
    CHECK(counts.get<std::uint64_t>() == 2);
    CHECK(counts.get<std::uint16_t>() == 1);
    CHECK(counts.get<std::uint64_t>() == 1);
    CHECK(counts.at_end());
    return;
  }
  FAIL("no statistics");
}

TEST_CASE("an MCAP file that cannot be written names itself") {
  CHECK_THROWS_WITH(McapWriter("/nowhere/a.mcap", ""), Catch::Contains("/nowhere/a.mcap"));
}
