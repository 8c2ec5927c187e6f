// Definitions of ROS messages, as recordings carry them.
#pragma once

#include <string>
#include <string_view>

#include "ports/bag_writers/messages.hpp"

namespace unimapper::bags {

/// Name of the type in ROS 1, e.g. "sensor_msgs/PointCloud2".
[[nodiscard]] std::string_view ros1_name(MessageType type);
/// Name of the type in ROS 2, e.g. "sensor_msgs/msg/PointCloud2".
[[nodiscard]] std::string ros2_name(MessageType type);
/// MD5 of the definition, by which ROS 1 recognises a type.
[[nodiscard]] std::string_view ros1_md5(MessageType type);
/// Definition with those of the types it is made of: ROS 1.
[[nodiscard]] std::string ros1_definition(MessageType type);
/// Definition with those of the types it is made of: ROS 2 (`ros2msg`).
[[nodiscard]] std::string ros2_definition(MessageType type);

}  // namespace unimapper::bags
