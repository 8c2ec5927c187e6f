// Tests of the writer of ROS 1 bags, against the layout of the format's version 2.0.
#include "ports/bag_writers/bag_writer.hpp"
#include "ports/datasets/bag/message_source.hpp"
#include "tests/ports/bag_writers/bytes.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::bags;

namespace {

struct Record {
  std::map<std::string, std::string> header;
  std::string data;
  [[nodiscard]] int op() const { return static_cast<unsigned char>(header.at("op").at(0)); }
};

std::map<std::string, std::string> fields(std::string_view bytes) {
  std::map<std::string, std::string> result;
  ByteReader reader(bytes);
  while (!reader.at_end()) {
    const std::string field(reader.text());
    const std::size_t equals = field.find('=');
    result[field.substr(0, equals)] = field.substr(equals + 1);
  }
  return result;
}

Record record_at(const std::string& file, std::size_t offset) {
  ByteReader reader(std::string_view(file).substr(offset));
  auto header = fields(reader.text());
  return {std::move(header), std::string(reader.text())};
}

std::size_t bytes_at(const std::string& file, std::size_t offset) {
  ByteReader reader(std::string_view(file).substr(offset));
  reader.text();
  reader.text();
  return reader.offset();
}

constexpr std::size_t kVersionBytes = 13;
constexpr std::int64_t kStamp_ns = 1'700'000'000'250'000'000;

/// A latched transform and two more messages.
struct Example {
  TemporaryDirectory folder;
  std::filesystem::path path = folder / "a.bag";
  Transforms mounting = {{{kStamp_ns, "base"}, "lidar", Pose()}};
  std::string file;

  Example() {
    const auto bag = create_bag(Container::kRosbag1, path);
    const std::size_t fixed = bag->add_topic({"/tf_static", MessageType::kTransforms, true});
    const std::size_t moving = bag->add_topic({"/tf", MessageType::kTransforms});
    bag->write(fixed, kStamp_ns, mounting);
    bag->write(moving, kStamp_ns + 1, Transforms{});
    bag->write(moving, kStamp_ns + 2, Transforms{});
    bag->close();
    file = read_bytes(path);
  }
};

}  // namespace

TEST_CASE("a ROS 1 bag begins with a padded record that leads to its index") {
  const Example example;
  const std::string& file = example.file;
  CHECK(file.substr(0, kVersionBytes) == "#ROSBAG V2.0\n");
  const Record first = record_at(file, kVersionBytes);
  CHECK(first.op() == 0x03);
  CHECK(bytes_at(file, kVersionBytes) == 4096 + 8);
  CHECK(number_at<std::uint32_t>(first.header.at("conn_count"), 0) == 2);
  CHECK(number_at<std::uint32_t>(first.header.at("chunk_count"), 0) == 1);
  std::size_t offset = number_at<std::uint64_t>(first.header.at("index_pos"), 0);
  std::vector<int> operations;
  while (offset < file.size()) {
    operations.push_back(record_at(file, offset).op());
    offset += bytes_at(file, offset);
  }
  CHECK(offset == file.size());
  CHECK(operations == std::vector<int>{0x07, 0x07, 0x06});
}

TEST_CASE("a ROS 1 bag says of a topic what it carries") {
  const Example example;
  const std::string& file = example.file;
  const Record first = record_at(file, kVersionBytes);
  const Record connection =
      record_at(file, number_at<std::uint64_t>(first.header.at("index_pos"), 0));
  CHECK(connection.header.at("topic") == "/tf_static");
  const auto data = fields(connection.data);
  CHECK(data.at("type") == "tf2_msgs/TFMessage");
  CHECK(data.at("md5sum") == "94810edda583a504dfda3829e70d7eec");
  CHECK(data.at("latching") == "1");
  CHECK(data.at("message_definition").find("geometry_msgs/TransformStamped[] transforms") == 0);
}

TEST_CASE("the index of a ROS 1 bag leads to every message, its chunks do so without it") {
  const Example example;
  const bool is_torn = GENERATE(false, true);
  if (is_torn) std::filesystem::resize_file(example.path, example.file.size() - 8);
  const auto source = datasets::bag::open_messages(example.path);
  CHECK(source->warnings().empty() != is_torn);
  REQUIRE(source->topics().size() == 2);
  REQUIRE(source->messages(0).size() == 1);
  CHECK(source->messages(0)[0].log_time_ns == kStamp_ns);
  CHECK((source->read(source->messages(0)[0]) == encode(Encoding::kRos1, example.mounting, 0)));
  REQUIRE(source->messages(1).size() == 2);
  for (const std::size_t i : {0U, 1U}) {
    CHECK(source->messages(1)[i].log_time_ns == kStamp_ns + 1 + static_cast<std::int64_t>(i));
    CHECK((source->read(source->messages(1)[i]) == encode(Encoding::kRos1, Transforms{})));
  }
}
