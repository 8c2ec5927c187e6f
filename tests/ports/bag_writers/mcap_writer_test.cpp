// Tests of the MCAP writer, against the layout of the specification.
#include "ports/bag_writers/mcap_writer.hpp"

#include "ports/datasets/bag/message_source.hpp"
#include "tests/ports/bag_writers/bytes.hpp"
#include "tests/ports/datasets/bag/mcap_file.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::bags;

namespace {

struct Record {
  std::uint8_t opcode;
  std::size_t offset;  ///< of its opcode
  std::string_view content;
};

/// Records one after the other, to the end of `bytes`.
std::vector<Record> records_of(std::string_view bytes, std::size_t first) {
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

const std::string kMagic = "\x89MCAP0\r\n";

/// Two channels and three messages, the last of them in a chunk of its own.
struct Example {
  TemporaryDirectory folder;
  std::string file;

  Example() {
    McapWriter writer(folder / "a.mcap", "ros2", 200);
    const std::uint16_t schema = writer.add_schema("nav_msgs/msg/Odometry", "ros2msg", "Pose pose");
    const std::uint16_t one = writer.add_channel(schema, "/one", "cdr");
    const std::uint16_t two = writer.add_channel(schema, "/two", "cdr", {{"key", "value"}});
    writer.write(one, 300, "first");
    writer.write(two, 100, std::string(200, 'x'));
    writer.write(one, 400, "third");
    writer.close();
    file = read_bytes(folder / "a.mcap");
  }
  [[nodiscard]] std::vector<Record> records() const {
    return records_of(std::string_view(file).substr(0, file.size() - kMagic.size()), kMagic.size());
  }
};

}  // namespace

TEST_CASE("an MCAP file lies between magic bytes and ends with statistics and an index") {
  const Example example;
  CHECK_THAT(example.file, Catch::StartsWith(kMagic) && Catch::EndsWith(kMagic));
  std::vector<int> opcodes;
  for (const Record& record : example.records()) opcodes.push_back(record.opcode);
  // Header; chunk, index of two channels; chunk, index of one; end of data; schema; two channels;
  // statistics; two chunk indexes; four summary offsets; footer.
  CHECK(opcodes == std::vector<int>{1, 6, 7, 7, 6, 7, 15, 3, 4, 4, 11, 8, 8, 14, 14, 14, 14, 2});
}

TEST_CASE("checksums of an MCAP file cover its data, chunks and summary, its index the chunks") {
  const Example example;
  const std::string& file = example.file;
  std::uint64_t summary_start = 0;
  // Times of the first and the last message, offset and bytes.
  std::vector<std::vector<std::uint64_t>> chunks;
  std::vector<std::vector<std::uint64_t>> indexed;
  for (const Record& record : example.records()) {
    const std::string_view content = record.content;
    if (record.opcode == 0x0F) {
      CHECK(number_at<std::uint32_t>(content, 0) ==
            datasets::bag::mcap_crc(file.substr(0, record.offset)));
      summary_start = record.offset + 9 + content.size();
    }
    if (record.opcode == 0x06) {
      ByteReader chunk(content);
      chunks.push_back({number_at<std::uint64_t>(content, 0), number_at<std::uint64_t>(content, 8),
                        record.offset, 9 + content.size()});
      chunk.take(16);
      const auto bytes = chunk.get<std::uint64_t>();
      const auto checksum = chunk.get<std::uint32_t>();
      CHECK(chunk.text().empty());
      CHECK(chunk.get<std::uint64_t>() == bytes);
      CHECK(datasets::bag::mcap_crc(chunk.take(bytes)) == checksum);
      CHECK(chunk.at_end());
    }
    if (record.opcode == 0x08) {
      ByteReader index(content);
      indexed.emplace_back();
      for (int i = 0; i < 4; ++i) indexed.back().push_back(index.get<std::uint64_t>());
    }
    if (record.opcode == 0x02) {
      CHECK(number_at<std::uint64_t>(content, 0) == summary_start);
      const std::string covered = file.substr(summary_start, record.offset + 25 - summary_start);
      CHECK(number_at<std::uint32_t>(content, 16) == datasets::bag::mcap_crc(covered));
    }
  }
  CHECK(indexed == chunks);
  REQUIRE(chunks.size() == 2);
  CHECK(chunks[0][0] == 100);
  CHECK(chunks[0][1] == 300);
}

TEST_CASE("the index of an MCAP file leads to every message, its chunks do so without it") {
  const Example example;
  const bool is_torn = GENERATE(false, true);
  const auto path = example.folder / "a.mcap";
  if (is_torn) std::filesystem::resize_file(path, example.file.size() - kMagic.size());
  const auto source = datasets::bag::open_messages(path);
  CHECK(source->warnings().empty() != is_torn);
  REQUIRE(source->topics().size() == 2);
  CHECK(source->topics()[1].name == "/two");
  const auto check = [&](std::size_t topic, std::size_t i, std::int64_t log_time_ns,
                         const std::string& content) {
    CHECK(source->messages(topic).at(i).log_time_ns == log_time_ns);
    CHECK(source->read(source->messages(topic).at(i)) == content);
  };
  check(0, 0, 300, "first");
  check(0, 1, 400, "third");
  check(1, 0, 100, std::string(200, 'x'));
}

TEST_CASE("an MCAP file counts its messages") {
  const Example example;
  for (const Record& record : example.records()) {
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
    for (const std::uint64_t channel : {0U, 1U}) {
      CHECK(counts.get<std::uint16_t>() == channel);
      CHECK(counts.get<std::uint64_t>() == 2 - channel);
    }
    CHECK(counts.at_end());
    return;
  }
  FAIL("no statistics");
}

TEST_CASE("an MCAP file that cannot be written names itself") {
  CHECK_THROWS_WITH(McapWriter("/nowhere/a.mcap", ""), Catch::Contains("/nowhere/a.mcap"));
}
