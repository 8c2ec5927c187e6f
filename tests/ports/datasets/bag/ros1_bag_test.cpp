// Tests of the reader of ROS 1 bags.
#include <catch2/catch.hpp>

#include "tests/ports/datasets/bag/foreign_recording.hpp"
#include "tests/ports/datasets/bag/message_writer.hpp"
#include "tests/ports/datasets/bag/opened_bag.hpp"

using namespace unimapper;
using namespace unimapper::datasets;
using namespace unimapper::datasets::bag;
using Catch::Matchers::Contains;

namespace {

const std::string kMagic = "#ROSBAG V2.0\n";

std::uint32_t size_of(std::string_view bytes) { return static_cast<std::uint32_t>(bytes.size()); }

std::string counted(std::string_view bytes) { return packed(size_of(bytes)) + std::string(bytes); }

/// One NAME=VALUE of a header.
std::string field(std::string_view name, std::string_view value) {
  return counted(std::string(name) + "=" + std::string(value));
}
std::string field(std::string_view name, std::uint32_t value) { return field(name, packed(value)); }

std::string record(std::uint8_t opcode, const std::string& fields, const std::string& data) {
  return counted(field("op", packed(opcode)) + fields) + counted(data);
}

std::string time_of(std::uint32_t nanoseconds) { return packed(0U, nanoseconds); }

std::string message(std::uint32_t time_ns) {
  return record(2, field("conn", 0) + field("time", time_of(time_ns)),
                "a" + std::to_string(time_ns));
}

/// A chunk, and the index of its messages at those times and offsets.
std::string chunk(const std::string& records,
                  const std::vector<std::pair<std::uint32_t, std::uint32_t>>& messages) {
  std::string places;
  for (const auto& [time_ns, offset] : messages) places += time_of(time_ns) + packed(offset);
  const auto count = static_cast<std::uint32_t>(messages.size());
  return record(5, field("compression", "none") + field("size", size_of(records)), records) +
         record(4, field("ver", 1) + field("conn", 0) + field("count", count), places);
}

std::string chunk_info(std::uint64_t start) {
  return record(6, field("ver", 1) + field("chunk_pos", packed(start)) + field("count", 1),
                packed(0U, 1U));
}

/// Two chunks by hand: a10 and a30, then a20.
struct HandMadeBag {
  std::string bytes;
  std::size_t first_chunk_end = 0;

  explicit HandMadeBag(bool has_index = true, std::uint32_t chunk_count = 2,
                       const std::string& more_fields = {}) {
    const auto file_header = [&](std::uint64_t index_start) {
      return record(3,
                    field("index_pos", packed(index_start)) + field("conn_count", 1) +
                        field("chunk_count", chunk_count) + more_fields,
                    std::string(64, ' '));
    };
    const std::string connection =
        record(7, field("conn", 0) + field("topic", "/a"),
               field("topic", "/a") + field("type", "nav_msgs/Odometry"));
    const std::string first = connection + message(10);
    const std::size_t start = kMagic.size() + file_header(0).size();
    std::string body =
        chunk(first + message(30), {{10, size_of(connection)}, {30, size_of(first)}});
    first_chunk_end = start + body.size();
    body += chunk(message(20), {{20, 0}});
    bytes = kMagic + file_header(has_index ? start + body.size() : 0) + body;
    if (has_index) bytes += connection + chunk_info(start) + chunk_info(first_chunk_end);
  }
};

OpenedBag opened(const std::string& bytes) { return OpenedBag("drive.bag", bytes); }

}  // namespace

#ifdef UNIMAPPER_BUILD_BAGS
TEST_CASE("a recording that Debian's python3-rosbag wrote, its chunks by bzip2 and LZ4, is read") {
  const auto dataset = open_dataset(foreign_file("drive.bag"));
  check_foreign_recording(*dataset);
  CHECK_THAT(notes_text(*dataset), Contains("of 'base_link' in 'odom'"));
}

TEST_CASE("a torn recording of python3-rosbag is read up to the tear") {
  const std::string bytes = read_bytes(foreign_file("drive.bag"));
  const TemporaryDirectory directory;
  // In the third of four chunks, each of which ends with a scan.
  const auto dataset = open_dataset(directory.write("torn.bag", bytes.substr(0, 6000)));
  CHECK(dataset->scan_count() == 2);
  CHECK_THAT(notes_text(*dataset), Contains("! the index is missing or damaged") &&
                                       Contains("! the file is torn or damaged after"));
}
#endif

TEST_CASE("messages of a ROS 1 bag come in order of time, with and without index") {
  for (const bool has_index : {true, false}) {
    const OpenedBag bag = opened(HandMadeBag(has_index).bytes);
    CHECK(all_messages(*bag.source) == "a10 a20 a30 ");
    CHECK(bag->warnings().empty() == has_index);
    CHECK(bag->topics()[0].name == "/a");
    CHECK(bag->topics()[0].type == "nav_msgs/Odometry");
    CHECK(bag->topics()[0].serialization == Serialization::kRos1);
    CHECK(bag->topics()[0].message_count == 3);
    CHECK(bag->read(bag->messages(0)[1], 2) == "a2");
  }
}

TEST_CASE("a ROS 1 bag cut anywhere gives the messages before the cut or is refused") {
  const HandMadeBag whole;
  cut_everywhere(
      "drive.bag", whole.bytes, kMagic.size(),
      [&](const OpenedBag& /*bag*/, std::size_t cut, const std::string& messages) {
        CHECK((messages.empty() || messages == "a10 a30 " || messages == "a10 a20 a30 "));
        if (cut >= whole.first_chunk_end) CHECK_FALSE(messages.empty());
      });
}

TEST_CASE("every changed byte of a ROS 1 bag is an error, a warning, or of no consequence") {
  change_every_byte("drive.bag", HandMadeBag().bytes);
}

TEST_CASE("a ROS 1 index without all chunks is passed over with a warning") {
  const OpenedBag bag = opened(HandMadeBag(true, 3).bytes);
  CHECK(all_messages(*bag.source) == "a10 a20 a30 ");
  REQUIRE(bag->warnings().size() == 1);
  CHECK_THAT(bag->warnings()[0], Contains("not every chunk is in it"));
}

TEST_CASE("bags of older versions and encrypted ones are refused with what to run") {
  const auto error = [](const std::string& bytes) { return error_of([&] { opened(bytes); }); };
  CHECK_THAT(error("#ROSRECORD V1.2\n" + std::string(100, ' ')), Contains("rosbag fix"));
  CHECK_THAT(error(HandMadeBag(true, 2, field("encryptor", "rosbag/AesCbcEncryptor")).bytes),
             Contains("rosbag decrypt"));
}
