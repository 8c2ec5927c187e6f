// Tests of the reader of MCAP files.
#include <catch2/catch.hpp>

#include "ports/datasets/bag/message_source.hpp"
#include "tests/ports/datasets/bag/mcap_file.hpp"
#include "tests/ports/datasets/fixtures.hpp"

using namespace unimapper;
using namespace unimapper::datasets;
using namespace unimapper::datasets::bag;
using Catch::Matchers::Contains;

namespace {

constexpr const char* kOdometry = "nav_msgs/msg/Odometry";

/// Two chunks of messages "a" to "d" on /a and /b; those of the chunks overlap in time.
McapFile two_chunks(bool has_index = true) {
  McapFile file;
  const auto a = file.topic("/a", kOdometry);
  const auto b = file.topic("/b", kOdometry);
  file.message(a, 10, "a10");
  file.message(b, 30, "b30");
  file.end_chunk(has_index);
  file.message(a, 20, "a20");
  file.message(b, 40, "b40");
  file.end_chunk(has_index);
  return file;
}

/// Messages of all topics in order of log time.
std::string all_messages(MessageSource& source) {
  std::vector<std::size_t> topics;
  for (std::size_t i = 0; i < source.topics().size(); ++i) topics.push_back(i);
  std::string messages;
  for_each_message(source, topics, [&](std::size_t topic, std::size_t number) {
    messages += std::string(source.read(source.messages(topic)[number])) + " ";
  });
  return messages;
}

struct Opened {
  TemporaryDirectory directory;
  std::unique_ptr<MessageSource> source;
  explicit Opened(std::string_view bytes)
      : source(open_messages(directory.write("drive.mcap", bytes))) {}
  MessageSource* operator->() const { return source.get(); }
};

}  // namespace

TEST_CASE("messages of an MCAP file come in order of time, with and without index") {
  for (const bool has_index : {true, false}) {
    const McapFile file = two_chunks(has_index);
    for (const bool has_summary : {true, false}) {
      const Opened opened(file.bytes(has_summary));
      CHECK(all_messages(*opened.source) == "a10 a20 b30 b40 ");
      CHECK(opened->warnings().empty());
      REQUIRE(opened->topics().size() == 2);
      CHECK(opened->topics()[0].name == "/a");
      CHECK(opened->topics()[0].type == "nav_msgs/Odometry");
      CHECK(opened->topics()[0].serialization == Serialization::kCdr);
      CHECK(opened->topics()[0].message_count == 2);
    }
  }
}

TEST_CASE("any message of an MCAP file can be read, or its first bytes") {
  const Opened opened(two_chunks().bytes());
  CHECK(opened->read(opened->messages(1)[1]) == "b40");
  CHECK(opened->read(opened->messages(0)[0]) == "a10");
  CHECK(opened->read(opened->messages(1)[0], 1) == "b");
}

TEST_CASE("messages outside of chunks are read") {
  McapFile file = two_chunks();
  file.message_outside(1, 25, "a25");
  const Opened opened(file.bytes());
  CHECK(all_messages(*opened.source) == "a10 a20 a25 b30 b40 ");
  CHECK(opened->read(opened->messages(0)[2], 2) == "a2");
}

TEST_CASE("topics of other kinds are counted, not indexed") {
  McapFile file;
  const auto image = file.topic("/camera", "sensor_msgs/msg/Image");
  const auto proto = file.topic("/proto", kOdometry, "protobuf");
  file.message(image, 1, "image");
  file.message(proto, 2, "proto");
  file.end_chunk();
  const Opened opened(file.bytes());
  CHECK(opened->messages(0).empty());
  CHECK(opened->messages(1).empty());
  CHECK(opened->topics()[0].message_count == 1);
  CHECK(opened->topics()[1].serialization == Serialization::kOther);
}

TEST_CASE("a torn MCAP file gives the messages before the tear, and says so") {
  const McapFile file = two_chunks();
  const std::string bytes = file.torn().substr(0, file.torn().size() - 100);
  const Opened opened(bytes);
  CHECK(all_messages(*opened.source) == "a10 b30 ");
  REQUIRE(opened->warnings().size() == 1);
  CHECK_THAT(opened->warnings()[0], Contains("torn"));
}

TEST_CASE("an MCAP file cut anywhere gives messages in order or is refused") {
  const std::string bytes = two_chunks().bytes();
  std::size_t most = 0;
  for (std::size_t cut = 0; cut < bytes.size(); ++cut) {
    try {
      const Opened opened(bytes.substr(0, cut));
      CHECK_FALSE(opened->warnings().empty());
      const std::string messages = all_messages(*opened.source);
      CHECK((messages.empty() || messages == "a10 b30 " || messages == "a10 a20 b30 b40 "));
      CHECK(messages.size() >= most);
      most = messages.size();
    } catch (const DatasetError& error) {
      CHECK_THAT(error.what(), Contains("drive.mcap"));
      CHECK(cut < 8);
    }
  }
  CHECK(most > 0);
}

TEST_CASE("an index that cannot be trusted is passed over with a warning") {
  const McapFile file = two_chunks();
  for (const std::string& bytes : {file.bytes(true, false), file.bytes(true, true, 1)}) {
    const Opened opened(bytes);
    CHECK(all_messages(*opened.source) == "a10 a20 b30 b40 ");
    REQUIRE(opened->warnings().size() == 1);
    CHECK_THAT(opened->warnings()[0], Contains("the index is damaged"));
  }
}

TEST_CASE("a chunk with a wrong checksum is left out and counted") {
  McapFile file;
  const auto a = file.topic("/a", kOdometry);
  file.message(a, 10, "a10");
  file.end_chunk(true, false);
  file.message(a, 20, "a20");
  file.end_chunk();
  const Opened scanned(file.bytes(false));
  CHECK(all_messages(*scanned.source) == "a20 ");
  REQUIRE(scanned->warnings().size() == 1);
  CHECK_THAT(scanned->warnings()[0],
             Contains("1 chunks or records (of 2 chunks)") && Contains("wrong checksum"));
  // With an index the damage shows when the message is read.
  const Opened indexed(file.bytes());
  CHECK_THAT(error_of([&] { (void)indexed->read(indexed->messages(0)[0]); }),
             Contains("drive.mcap: message at 10 ns: chunk with a wrong checksum"));
  CHECK(indexed->read(indexed->messages(0)[1]) == "a20");
}

TEST_CASE("every flipped byte of an MCAP file is an error, a warning, or of no consequence") {
  const std::string bytes = two_chunks().bytes();
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::string damaged = bytes;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x55);
    try {
      const Opened opened(damaged);
      (void)all_messages(*opened.source);
    } catch (const DatasetError& error) {
      CHECK_THAT(error.what(), Contains("drive.mcap"));
    }
  }
}

TEST_CASE("files of one recording in a folder are read as one") {
  McapFile first;
  first.message(first.topic("/a", kOdometry), 10, "a10");
  first.end_chunk();
  McapFile second;
  second.message(second.topic("/a", kOdometry), 20, "a20");
  second.end_chunk();
  const TemporaryDirectory directory;
  directory.write("drive_0.mcap", first.bytes());
  directory.write("drive_1.mcap", second.bytes());
  const auto source = open_messages(directory.path());
  CHECK(all_messages(*source) == "a10 a20 ");
  CHECK(source->topics().size() == 1);
  CHECK(source->topics()[0].message_count == 2);

  // Other names are other recordings.
  std::filesystem::rename(directory / "drive_1.mcap", directory / "back.mcap");
  CHECK_THAT(error_of([&] { open_messages(directory.path()); }),
             Contains("holds several bags: back.mcap, drive_0.mcap; name one"));
}
