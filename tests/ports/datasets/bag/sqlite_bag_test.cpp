// Tests of the reader of ROS 2 bags in SQLite.
#include <catch2/catch.hpp>

#include "ports/datasets/bag/message_source.hpp"
#include "tests/ports/datasets/bag/foreign_recording.hpp"
#include "tests/ports/datasets/fixtures.hpp"

using namespace unimapper;
using namespace unimapper::datasets;
using namespace unimapper::datasets::bag;
using Catch::Matchers::Contains;

TEST_CASE("a recording that Python's sqlite3 wrote is read") {
  const auto dataset = open_dataset(foreign_file("drive.db3"));
  check_foreign_recording(*dataset);
  CHECK_THAT(notes_text(*dataset), Contains("1 scan of 4 without a pose left out"));
}

TEST_CASE("messages that were compressed one by one are read") {
  check_foreign_recording(*open_dataset(foreign_file("drive_zstd.db3")));
}

TEST_CASE("a file that was compressed as a whole is read, and leaves nothing behind") {
  const auto temporary_bags = [] {
    std::size_t count = 0;
    for (const auto& entry :
         std::filesystem::directory_iterator(std::filesystem::temp_directory_path())) {
      if (entry.path().filename().string().starts_with("unimapper-bag-")) ++count;
    }
    return count;
  };
  const std::size_t before = temporary_bags();
  check_foreign_recording(*open_dataset(foreign_file("drive_0.db3.zstd")));
  CHECK(temporary_bags() == before);
}

TEST_CASE("a folder as rosbag2 writes it is one recording") {
  const TemporaryDirectory directory;
  directory.write("drive_0.db3", read_bytes(foreign_file("drive.db3")));
  directory.write("metadata.yaml", "rosbag2_bagfile_information:\n  version: 5\n");
  check_foreign_recording(*open_dataset(directory.path()));
}

TEST_CASE("any message of an SQLite bag can be read, or its first bytes") {
  const auto source = open_messages(foreign_file("drive.db3"));
  REQUIRE(source->topics().size() == 4);
  CHECK(source->topics()[1].name == "/odom");
  CHECK(source->topics()[1].message_count == 16);
  CHECK(source->topics()[3].message_count == 1);
  CHECK(source->messages(3).empty());
  const std::string first = std::string(source->read(source->messages(1)[0]));
  CHECK(first.size() == 724);
  CHECK(source->read(source->messages(1)[15]) != first);
  CHECK(source->read(source->messages(1)[0], 8) == first.substr(0, 8));
  CHECK(source->read(source->messages(1)[0], 2) == first.substr(0, 2));
}

TEST_CASE("a database that is damaged anywhere is an error, a warning, or of no consequence") {
  const std::string bytes = read_bytes(foreign_file("drive_zstd.db3"));
  const TemporaryDirectory directory;
  for (std::size_t i = 16; i < bytes.size(); i += 7) {
    std::string damaged = bytes;
    for (std::size_t k = i; k < std::min(i + 4, bytes.size()); ++k) damaged[k] = '\xFF';
    const auto file = directory.write("drive.db3", damaged);
    try {
      const auto source = open_messages(file);
      for (std::size_t topic = 0; topic < source->topics().size(); ++topic) {
        for (const MessagePlace& place : source->messages(topic)) (void)source->read(place);
      }
    } catch (const DatasetError& error) {
      CHECK_THAT(error.what(), Contains("drive.db3"));
    }
  }
}

TEST_CASE("a torn database and one that is no bag are refused by name") {
  const std::string bytes = read_bytes(foreign_file("drive.db3"));
  const TemporaryDirectory directory;
  const auto torn = directory.write("torn.db3", bytes.substr(0, 300));
  CHECK_THAT(error_of([&] { open_messages(torn); }), Contains("torn.db3"));
  const auto empty = directory.write("empty.db3", "");
  CHECK_THAT(error_of([&] { open_messages(empty); }), Contains("is not a bag"));
  std::string other = bytes;
  while (other.find("messages") != std::string::npos) {
    other.replace(other.find("messages"), 8, "letters_");
  }
  const auto no_bag = directory.write("other.db3", other);
  CHECK_THAT(error_of([&] { open_messages(no_bag); }), Contains("no table 'messages'"));
}
