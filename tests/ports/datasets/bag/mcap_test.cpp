// Tests of the reader of MCAP files.
#include <catch2/catch.hpp>

#include "tests/ports/datasets/bag/mcap_file.hpp"
#include "tests/ports/datasets/bag/opened_bag.hpp"

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

OpenedBag opened(const std::string& bytes) { return OpenedBag("drive.mcap", bytes); }

}  // namespace

TEST_CASE("messages of an MCAP file come in order of time, with and without index") {
  const bool has_index = GENERATE(true, false);
  const bool has_summary = GENERATE(true, false);
  const OpenedBag bag = opened(two_chunks(has_index).bytes(has_summary));
  CHECK(all_messages(*bag.source) == "a10 a20 b30 b40 ");
  CHECK(bag->warnings().empty());
  REQUIRE(bag->topics().size() == 2);
  CHECK(bag->topics()[0].name == "/a");
  CHECK(bag->topics()[0].type == "nav_msgs/Odometry");
  CHECK(bag->topics()[0].serialization == Serialization::kCdr);
  CHECK(bag->topics()[0].message_count == 2);
  CHECK(bag->read(bag->messages(1)[1]) == "b40");
  CHECK(bag->read(bag->messages(0)[0], 1) == "a");
}

TEST_CASE("messages outside of chunks are read") {
  McapFile file = two_chunks();
  file.message_outside(1, 25, "a25");
  const OpenedBag bag = opened(file.bytes());
  CHECK(all_messages(*bag.source) == "a10 a20 a25 b30 b40 ");
  CHECK(bag->read(bag->messages(0)[2], 2) == "a2");
}

TEST_CASE("topics of other kinds are counted, not indexed") {
  McapFile file;
  file.message(file.topic("/camera", "sensor_msgs/msg/Image"), 1, "image");
  file.message(file.topic("/proto", kOdometry, "protobuf"), 2, "proto");
  file.end_chunk();
  const OpenedBag bag = opened(file.bytes());
  CHECK(bag->messages(0).empty());
  CHECK(bag->messages(1).empty());
  CHECK(bag->topics()[0].message_count == 1);
  CHECK(bag->topics()[1].serialization == Serialization::kOther);
}

TEST_CASE("an MCAP file cut anywhere gives messages in order, and says so, or is refused") {
  const McapFile file = two_chunks();
  const std::size_t data_end = file.torn().size() + mcap_record(0x0F, packed(0U)).size();
  std::string most;
  cut_everywhere(
      "drive.mcap", file.bytes(), 8,
      [&](const OpenedBag& bag, std::size_t cut, const std::string& messages) {
        CHECK((messages.empty() || messages == "a10 b30 " || messages == "a10 a20 b30 b40 "));
        CHECK(messages.size() >= most.size());
        most = messages;
        CHECK_THAT(bag->warnings()[0],
                   Contains(cut < data_end ? "is torn" : "end of the file is missing"));
        if (cut + 100 == file.torn().size()) CHECK(messages == "a10 b30 ");
      });
  CHECK(most == "a10 a20 b30 b40 ");
}

TEST_CASE("an index that cannot be trusted is passed over with a warning") {
  const McapFile file = two_chunks();
  for (const std::string& bytes : {file.bytes(true, false), file.bytes(true, true, 1)}) {
    const OpenedBag bag = opened(bytes);
    CHECK(all_messages(*bag.source) == "a10 a20 b30 b40 ");
    REQUIRE(bag->warnings().size() == 1);
    CHECK_THAT(bag->warnings()[0], Contains("the index is damaged"));
  }
}

TEST_CASE("a chunk with a wrong checksum is left out and counted") {
  McapFile file;
  const auto a = file.topic("/a", kOdometry);
  file.message(a, 10, "a10");
  file.end_chunk(true, false);
  file.message(a, 20, "a20");
  file.end_chunk();
  const OpenedBag scanned = opened(file.bytes(false));
  CHECK(all_messages(*scanned.source) == "a20 ");
  REQUIRE(scanned->warnings().size() == 1);
  CHECK_THAT(scanned->warnings()[0],
             Contains("1 chunks or records (of 2 chunks)") && Contains("wrong checksum"));
  // With an index the damage shows when the message is read.
  const OpenedBag indexed = opened(file.bytes());
  CHECK_THAT(error_of([&] { (void)indexed->read(indexed->messages(0)[0]); }),
             Contains("drive.mcap: message at 10 ns: chunk with a wrong checksum"));
  CHECK(indexed->read(indexed->messages(0)[1]) == "a20");
}

TEST_CASE("every changed byte of an MCAP file is an error, a warning, or of no consequence") {
  change_every_byte("drive.mcap", two_chunks().bytes());
}

TEST_CASE("files of one recording in a folder are read as one") {
  const TemporaryDirectory directory;
  for (const std::string number : {"0", "1"}) {
    McapFile file;
    file.message(file.topic("/a", kOdometry), std::stoi(number), "a" + number);
    file.end_chunk();
    directory.write("drive_" + number + ".mcap", file.bytes());
  }
  const auto source = open_messages(directory.path());
  CHECK(all_messages(*source) == "a0 a1 ");
  CHECK(source->topics().size() == 1);
  CHECK(source->topics()[0].message_count == 2);

  // Other names are other recordings.
  std::filesystem::rename(directory / "drive_1.mcap", directory / "back.mcap");
  CHECK_THAT(error_of([&] { open_messages(directory.path()); }),
             Contains("holds several bags: back.mcap, drive_0.mcap; name one"));
}
