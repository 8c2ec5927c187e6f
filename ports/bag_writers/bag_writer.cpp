#include "ports/bag_writers/bag_writer.hpp"

#include "ports/bag_writers/containers.hpp"
#include "ports/bag_writers/output_file.hpp"

namespace unimapper::bags {

std::optional<Container> parse_container(std::string_view name) {
  if (name == "mcap") return Container::kMcap;
  if (name == "rosbag1") return Container::kRosbag1;
  if (name == "rosbag2") return Container::kRosbag2;
  return std::nullopt;
}

std::string offered_qos_profiles(const Topic& topic) {
  // Volatile, or transient local: kept for who subscribes later.
  const std::string durability = topic.is_latched ? "1" : "2";
  return "- history: 3\n  depth: 0\n  reliability: 1\n  durability: " + durability +
         "\n  deadline:\n    sec: 9223372036\n    nsec: 854775807\n"
         "  lifespan:\n    sec: 9223372036\n    nsec: 854775807\n"
         "  liveliness: 1\n"
         "  liveliness_lease_duration:\n    sec: 9223372036\n    nsec: 854775807\n"
         "  avoid_ros_namespace_conventions: false";
}

std::unique_ptr<BagWriter> create_bag(Container container, const std::filesystem::path& path) {
  switch (container) {
    case Container::kRosbag1:
      return create_rosbag1(path);
    case Container::kRosbag2:
      return create_rosbag2(path);
    case Container::kMcap:
      break;
  }
  return create_mcap(path);
}

}  // namespace unimapper::bags
