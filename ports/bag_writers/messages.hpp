// ROS messages of a robot with a LiDAR and an odometry.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "unimapper/core/pose.hpp"

namespace unimapper::bags {

/// Kinds of messages that a recording may hold.
enum class MessageType : std::uint8_t {
  kPointCloud2,  ///< sensor_msgs/PointCloud2
  kOdometry,     ///< nav_msgs/Odometry
  kTransforms,   ///< tf2_msgs/TFMessage
  kImu,          ///< sensor_msgs/Imu
};

/// Stamp and frame of a message.
struct Header {
  std::int64_t stamp_ns = 0;
  std::string frame_id;
};

/// A point as a driver of a spinning LiDAR publishes it.
struct CloudPoint {
  float x;             ///< metres in the frame of the header
  float y;             ///< metres
  float z;             ///< metres
  float intensity;     ///< as the sensor gives it
  std::uint16_t ring;  ///< number of the laser
  float time_s;        ///< seconds after the header's stamp, may be negative
};

/// sensor_msgs/PointCloud2 of fields x, y, z, intensity, ring and time, 22 bytes a point, packed
/// (the layout of the Velodyne driver).
struct PointCloud2 {
  Header header;
  std::span<const CloudPoint> points;
};

/// sensor_msgs/PointField of one number.
struct PointField {
  enum Type : std::uint8_t { kUint8 = 2, kUint16 = 4, kUint32 = 6, kFloat32 = 7 };
  std::string_view name;
  std::uint32_t offset;
  Type type;
};

/// sensor_msgs/PointCloud2 of any fields.
struct PackedCloud {
  Header header;
  std::span<const PointField> fields;
  std::uint32_t point_bytes;
  std::string_view points;  ///< `point_bytes` each
};

/// nav_msgs/Odometry: pose of `child_frame_id` in the header's frame, its velocities in
/// `child_frame_id`. Covariances are left zero: unknown.
struct Odometry {
  Header header;
  std::string child_frame_id;
  Pose pose;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();   ///< metres per second
  Eigen::Vector3d turn_rate = Eigen::Vector3d::Zero();  ///< radians per second
};

/// geometry_msgs/TransformStamped: T_header_child.
struct Transform {
  Header header;
  std::string child_frame_id;
  Pose transform;
};

/// sensor_msgs/Imu that says it has no orientation.
struct Imu {
  Header header;
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();     ///< radians per second
  Eigen::Vector3d linear_acceleration = Eigen::Vector3d::Zero();  ///< m/s², at rest along up
};

/// tf2_msgs/TFMessage.
using Transforms = std::vector<Transform>;

}  // namespace unimapper::bags
