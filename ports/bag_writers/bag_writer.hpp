// Writer of recordings of ROS messages, independent of their container.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ports/bag_writers/encoding.hpp"
#include "ports/bag_writers/messages.hpp"

namespace unimapper::bags {

/// A named stream of messages of one type.
struct Topic {
  std::string name;
  MessageType type = MessageType::kPointCloud2;
  bool is_latched = false;  ///< what was said last holds for who comes later (static transforms)
};

/// Containers of messages.
enum class Container : std::uint8_t {
  kMcap,     ///< one file, messages in CDR
  kRosbag1,  ///< one file (.bag, version 2.0), messages of ROS 1
  kRosbag2,  ///< a folder with an SQLite file (.db3) and metadata.yaml, messages in CDR
};

/// Parses "mcap", "rosbag1" or "rosbag2".
[[nodiscard]] std::optional<Container> parse_container(std::string_view name);

/// Writes messages in the order in which they come. All members throw BagError.
class BagWriter {
 public:
  virtual ~BagWriter() = default;
  /// Returns the number by which `write` knows the topic.
  virtual std::size_t add_topic(const Topic& topic) = 0;
  /// Ends the recording; without it the file stays without its index.
  virtual void close() = 0;

  /// Writes a message of the topic's type, recorded at `stamp_ns`.
  template <typename Message>
  void write(std::size_t topic, std::int64_t stamp_ns, const Message& message) {
    if (counts_.size() <= topic) counts_.resize(topic + 1);
    write_bytes(topic, stamp_ns, encode(encoding_, message, counts_[topic]++));
  }

 protected:
  explicit BagWriter(Encoding encoding) : encoding_(encoding) {}
  virtual void write_bytes(std::size_t topic, std::int64_t stamp_ns, std::string_view message) = 0;

 private:
  Encoding encoding_;
  std::vector<std::uint32_t> counts_;
};

/// Quality of service of a topic, as rosbag2 writes it.
[[nodiscard]] std::string offered_qos_profiles(const Topic& topic);

/// Creates a recording at `path`: a file, or for kRosbag2 a folder. Throws BagError.
[[nodiscard]] std::unique_ptr<BagWriter> create_bag(Container container,
                                                    const std::filesystem::path& path);

}  // namespace unimapper::bags
