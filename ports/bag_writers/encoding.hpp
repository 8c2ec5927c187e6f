// Serialisation of ROS messages: ROS 1, and CDR of ROS 2.
#pragma once

#include <string>

#include "ports/bag_writers/messages.hpp"

namespace unimapper::bags {

/// How messages become bytes.
enum class Encoding : std::uint8_t {
  kRos1,  ///< packed, headers with a sequence number
  kCdr,   ///< little-endian CDR with its encapsulation header; numbers aligned to their size
};

/// The message as bytes. `sequence` numbers the headers of ROS 1. O(bytes).
[[nodiscard]] std::string encode(Encoding encoding, const PointCloud2& cloud,
                                 std::uint32_t sequence = 0);
/// The cloud as bytes. `sequence` numbers the headers of ROS 1. O(bytes).
[[nodiscard]] std::string encode(Encoding encoding, const PackedCloud& cloud,
                                 std::uint32_t sequence = 0);
/// The odometry as bytes. `sequence` numbers the headers of ROS 1. O(bytes).
[[nodiscard]] std::string encode(Encoding encoding, const Odometry& odometry,
                                 std::uint32_t sequence = 0);
/// The angular velocity as bytes. `sequence` numbers the headers of ROS 1. O(bytes).
[[nodiscard]] std::string encode(Encoding encoding, const Imu& imu, std::uint32_t sequence = 0);
/// The transforms as bytes. `sequence` numbers the headers of ROS 1. O(bytes).
[[nodiscard]] std::string encode(Encoding encoding, const Transforms& transforms,
                                 std::uint32_t sequence = 0);

}  // namespace unimapper::bags
