// Tests of the reader of ROS 1 bags.
#include <catch2/catch.hpp>

#include "ports/datasets/bag/message_source.hpp"
#include "tests/ports/datasets/bag/foreign_recording.hpp"
#include "tests/ports/datasets/bag/message_writer.hpp"
#include "tests/ports/datasets/fixtures.hpp"

using namespace unimapper;
using namespace unimapper::datasets;
using namespace unimapper::datasets::bag;
using Catch::Matchers::Contains;

namespace {

const std::string kMagic = "#ROSBAG V2.0\n";

std::string counted(std::string_view bytes) {
  return packed(static_cast<std::uint32_t>(bytes.size())) + std::string(bytes);
}

/// One NAME=VALUE of a header.
std::string field(std::string_view name, std::string_view value) {
  return counted(std::string(name) + "=" + std::string(value));
}

std::string record(std::uint8_t opcode, const std::string& fields, const std::string& data) {
  return counted(field("op", packed(opcode)) + fields) + counted(data);
}

std::string connection(std::uint32_t number, const std::string& topic) {
  return record(7, field("conn", packed(number)) + field("topic", topic),
                field("topic", topic) + field("type", "nav_msgs/Odometry"));
}

std::string time_of(std::uint32_t nanoseconds) { return packed(std::uint32_t{0}, nanoseconds); }

std::string message(std::uint32_t connection, std::uint32_t time_ns, const std::string& data) {
  return record(2, field("conn", packed(connection)) + field("time", time_of(time_ns)), data);
}

std::string chunk(const std::string& records) {
  return record(5,
                field("compression", "none") +
                    field("size", packed(static_cast<std::uint32_t>(records.size()))),
                records);
}

/// Two chunks by hand: a10 and a30, then a20.
struct HandMadeBag {
  std::string bytes;
  std::size_t first_chunk_end = 0;

  explicit HandMadeBag(bool has_index = true, std::uint32_t chunk_count = 2,
                       const std::string& more_fields = {}) {
    const std::string a = connection(0, "/a");
    const auto file_header = [&](std::uint64_t index) {
      return record(3,
                    field("index_pos", packed(index)) +
                        field("conn_count", packed(std::uint32_t{1})) +
                        field("chunk_count", packed(chunk_count)) + more_fields,
                    std::string(64, ' '));
    };
    const std::string first = a + message(0, 10, "a10");
    const std::string one = chunk(first + message(0, 30, "a30"));
    const std::string two = chunk(message(0, 20, "a20"));
    const auto index_record = [](const std::string& places, std::uint32_t count) {
      return record(4,
                    field("ver", packed(std::uint32_t{1})) +
                        field("conn", packed(std::uint32_t{0})) + field("count", packed(count)),
                    places);
    };
    const std::string places = time_of(10) + packed(static_cast<std::uint32_t>(a.size())) +
                               time_of(30) + packed(static_cast<std::uint32_t>(first.size()));
    const std::uint64_t one_start = kMagic.size() + file_header(0).size();
    std::string body = one + index_record(places, 2);
    const std::uint64_t two_start = one_start + body.size();
    body += two + index_record(time_of(20) + packed(std::uint32_t{0}), 1);
    const std::uint64_t index_start = has_index ? one_start + body.size() : 0;
    const auto chunk_info = [](std::uint64_t start) {
      return record(6,
                    field("ver", packed(std::uint32_t{1})) + field("chunk_pos", packed(start)) +
                        field("count", packed(std::uint32_t{1})),
                    packed(std::uint32_t{0}, std::uint32_t{1}));
    };
    bytes = kMagic + file_header(index_start) + body;
    first_chunk_end = static_cast<std::size_t>(two_start);
    if (has_index) bytes += a + chunk_info(one_start) + chunk_info(two_start);
  }
};

std::string messages_of(MessageSource& source) {
  std::string messages;
  if (source.topics().empty()) return messages;
  for (const MessagePlace& place : source.messages(0)) {
    messages += std::string(source.read(place)) + " ";
  }
  return messages;
}

struct Opened {
  TemporaryDirectory directory;
  std::unique_ptr<MessageSource> source;
  explicit Opened(std::string_view bytes)
      : source(open_messages(directory.write("drive.bag", bytes))) {}
  MessageSource* operator->() const { return source.get(); }
};

}  // namespace

#ifdef UNIMAPPER_BUILD_BAGS
TEST_CASE("recordings that Debian's python3-rosbag wrote are read") {
  for (const char* name : {"drive_bz2.bag", "drive_lz4.bag"}) {
    const auto dataset = open_dataset(foreign_file(name));
    check_foreign_recording(*dataset);
    CHECK_THAT(notes_text(*dataset), Contains("of 'base_link' in 'odom'"));
  }
}

TEST_CASE("a torn recording of python3-rosbag is read up to the tear") {
  const std::string bytes = read_bytes(foreign_file("drive_lz4.bag"));
  const TemporaryDirectory directory;
  const auto dataset = open_dataset(directory.write("torn.bag", bytes.substr(0, 11000)));
  CHECK(dataset->scan_count() > 0);
  CHECK_THAT(notes_text(*dataset), Contains("! the index is missing or damaged") &&
                                       Contains("! the file is torn or damaged after"));
}
#endif

TEST_CASE("messages of a ROS 1 bag come in order of time, with and without index") {
  for (const bool has_index : {true, false}) {
    const Opened opened(HandMadeBag(has_index).bytes);
    CHECK(messages_of(*opened.source) == "a10 a20 a30 ");
    CHECK(opened->warnings().empty() == has_index);
    CHECK(opened->topics()[0].name == "/a");
    CHECK(opened->topics()[0].type == "nav_msgs/Odometry");
    CHECK(opened->topics()[0].serialization == Serialization::kRos1);
    CHECK(opened->topics()[0].message_count == 3);
    CHECK(opened->read(opened->messages(0)[1], 2) == "a2");
  }
}

TEST_CASE("a ROS 1 bag cut anywhere gives the messages before the cut or is refused") {
  const HandMadeBag whole;
  for (std::size_t cut = 0; cut < whole.bytes.size(); ++cut) {
    try {
      const Opened opened(whole.bytes.substr(0, cut));
      CHECK_FALSE(opened->warnings().empty());
      const std::string messages = messages_of(*opened.source);
      CHECK((messages.empty() || messages == "a10 a30 " || messages == "a10 a20 a30 "));
      if (cut >= whole.first_chunk_end) CHECK_FALSE(messages.empty());
    } catch (const DatasetError& error) {
      CHECK_THAT(error.what(), Contains("drive.bag"));
      CHECK(cut < kMagic.size());
    }
  }
}

TEST_CASE("every flipped byte of a ROS 1 bag is an error, a warning, or of no consequence") {
  const std::string bytes = HandMadeBag().bytes;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::string damaged = bytes;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x55);
    try {
      const Opened opened(damaged);
      (void)messages_of(*opened.source);
    } catch (const DatasetError& error) {
      CHECK_THAT(error.what(), Contains("drive.bag"));
    }
  }
}

TEST_CASE("a ROS 1 index without all chunks is passed over with a warning") {
  const Opened opened(HandMadeBag(true, 3).bytes);
  CHECK(messages_of(*opened.source) == "a10 a20 a30 ");
  REQUIRE(opened->warnings().size() == 1);
  CHECK_THAT(opened->warnings()[0], Contains("not every chunk is in it"));
}

TEST_CASE("bags of older versions and encrypted ones are refused with what to run") {
  const TemporaryDirectory directory;
  const auto old = directory.write("old.bag", "#ROSRECORD V1.2\n" + std::string(100, ' '));
  CHECK_THAT(error_of([&] { open_messages(old); }), Contains("rosbag fix"));
  const auto encrypted = directory.write(
      "encrypted.bag", HandMadeBag(true, 2, field("encryptor", "rosbag/AesCbcEncryptor")).bytes);
  CHECK_THAT(error_of([&] { open_messages(encrypted); }), Contains("rosbag decrypt"));
}
