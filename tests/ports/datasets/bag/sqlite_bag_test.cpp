// Tests of the reader of ROS 2 bags in SQLite.
#include <catch2/catch.hpp>

#include "tests/ports/datasets/bag/foreign_recording.hpp"
#include "tests/ports/datasets/bag/opened_bag.hpp"

using namespace unimapper;
using namespace unimapper::datasets;
using namespace unimapper::datasets::bag;
using Catch::Matchers::Contains;

TEST_CASE("a recording that the program sqlite3 wrote, its messages compressed, is read") {
  const auto dataset = open_dataset(foreign_file("drive_zstd.db3"));
  check_foreign_recording(*dataset);
  CHECK_THAT(notes_text(*dataset), Contains("1 scan of 4 without a pose left out"));
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
  directory.write("drive_0.db3", read_bytes(foreign_file("drive_zstd.db3")));
  directory.write("metadata.yaml", "rosbag2_bagfile_information:\n  version: 5\n");
  check_foreign_recording(*open_dataset(directory.path()));
}

TEST_CASE("any message of an SQLite bag can be read, or its first bytes") {
  const auto source = open_messages(foreign_file(GENERATE("drive_zstd.db3", "drive_0.db3.zstd")));
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
  for (std::size_t i = 16; i < bytes.size(); i += 7) {
    std::string damaged = bytes;
    for (std::size_t k = i; k < std::min(i + 4, bytes.size()); ++k) damaged[k] = '\xFF';
    try {
      (void)all_messages(*OpenedBag("drive.db3", damaged).source);
    } catch (const DatasetError& error) {
      CHECK_THAT(error.what(), Contains("drive.db3"));
    }
  }
}

TEST_CASE("of a database without its end the messages before are read, with a warning") {
  const std::string bytes = read_bytes(foreign_file("drive_zstd.db3"));
  const OpenedBag bag("drive.db3", bytes.substr(0, bytes.size() - 1024));
  REQUIRE(bag->warnings().size() >= 1);
  CHECK_THAT(bag->warnings()[0], Contains("the end of the database is missing"));
  CHECK(bag->messages(1).size() > 8);
}

TEST_CASE("a torn database and one that is no bag are refused by name") {
  const std::string bytes = read_bytes(foreign_file("drive_zstd.db3"));
  std::string other = bytes;
  while (other.find("messages") != std::string::npos) {
    other.replace(other.find("messages"), 8, "letters_");
  }
  const auto error = [](const std::string& content) {
    return error_of([&] { OpenedBag("drive.db3", content); });
  };
  CHECK_THAT(error(bytes.substr(0, 300)), Contains("drive.db3"));
  CHECK_THAT(error(""), Contains("is not a bag"));
  CHECK_THAT(error(other), Contains("no table 'messages'"));
}
