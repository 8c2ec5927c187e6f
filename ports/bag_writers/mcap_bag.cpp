// Recordings of ROS 2 messages as MCAP files.
#include <vector>

#include "ports/bag_writers/containers.hpp"
#include "ports/bag_writers/mcap_writer.hpp"
#include "ports/bag_writers/message_definitions.hpp"

namespace unimapper::bags {
namespace {

class McapBag : public BagWriter {
 public:
  explicit McapBag(const std::filesystem::path& file)
      : BagWriter(Encoding::kCdr), writer_(file, "ros2") {}

  std::size_t add_topic(const Topic& topic) override {
    auto [schema, is_new] = schemas_.try_emplace(topic.type, std::uint16_t{0});
    if (is_new) {
      schema->second =
          writer_.add_schema(ros2_name(topic.type), "ros2msg", ros2_definition(topic.type));
    }
    return writer_.add_channel(schema->second, topic.name, "cdr",
                               {{"offered_qos_profiles", offered_qos_profiles(topic)}});
  }
  void close() override { writer_.close(); }

 protected:
  void write_bytes(std::size_t topic, std::int64_t stamp_ns, std::string_view message) override {
    writer_.write(static_cast<std::uint16_t>(topic), static_cast<std::uint64_t>(stamp_ns), message);
  }

 private:
  McapWriter writer_;
  std::map<MessageType, std::uint16_t> schemas_;
};

}  // namespace

std::unique_ptr<BagWriter> create_mcap(const std::filesystem::path& file) {
  return std::make_unique<McapBag>(file);
}

}  // namespace unimapper::bags
