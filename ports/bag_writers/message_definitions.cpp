#include "ports/bag_writers/message_definitions.hpp"

#include <array>
#include <initializer_list>
#include <vector>

namespace unimapper::bags {
namespace {

/// Fields of one type. Where ROS 1 and ROS 2 differ, the second text is that of ROS 2.
struct Definition {
  std::string_view name;
  std::string_view fields;
  std::string_view ros2_fields = {};
};

constexpr std::array<Definition, 16> kDefinitions = {{
    {"sensor_msgs/PointCloud2",
     "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\n"
     "bool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n"},
    {"sensor_msgs/PointField",
     "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\nuint8 INT32=5\nuint8 UINT32=6\n"
     "uint8 FLOAT32=7\nuint8 FLOAT64=8\n"
     "string name\nuint32 offset\nuint8 datatype\nuint32 count\n"},
    {"nav_msgs/Odometry",
     "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
     "geometry_msgs/TwistWithCovariance twist\n"},
    {"sensor_msgs/Imu",
     "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\n"
     "float64[9] orientation_covariance\ngeometry_msgs/Vector3 angular_velocity\n"
     "float64[9] angular_velocity_covariance\ngeometry_msgs/Vector3 linear_acceleration\n"
     "float64[9] linear_acceleration_covariance\n"},
    {"tf2_msgs/TFMessage", "geometry_msgs/TransformStamped[] transforms\n"},
    {"geometry_msgs/TransformStamped",
     "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n"},
    {"geometry_msgs/Transform",
     "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"},
    {"geometry_msgs/PoseWithCovariance", "geometry_msgs/Pose pose\nfloat64[36] covariance\n"},
    {"geometry_msgs/TwistWithCovariance", "geometry_msgs/Twist twist\nfloat64[36] covariance\n"},
    {"geometry_msgs/Pose", "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"},
    {"geometry_msgs/Twist", "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n"},
    {"geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"},
    {"geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"},
    {"geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"},
    {"std_msgs/Header", "uint32 seq\ntime stamp\nstring frame_id\n",
     "builtin_interfaces/Time stamp\nstring frame_id\n"},
    {"builtin_interfaces/Time", "", "int32 sec\nuint32 nanosec\n"},
}};

/// A type with the types it is made of, each after the first that names it.
std::vector<std::string_view> types_of(MessageType type) {
  switch (type) {
    case MessageType::kPointCloud2:
      return {"sensor_msgs/PointCloud2", "std_msgs/Header", "sensor_msgs/PointField"};
    case MessageType::kOdometry:
      return {"nav_msgs/Odometry",
              "std_msgs/Header",
              "geometry_msgs/PoseWithCovariance",
              "geometry_msgs/Pose",
              "geometry_msgs/Point",
              "geometry_msgs/Quaternion",
              "geometry_msgs/TwistWithCovariance",
              "geometry_msgs/Twist",
              "geometry_msgs/Vector3"};
    case MessageType::kImu:
      return {"sensor_msgs/Imu", "std_msgs/Header", "geometry_msgs/Quaternion",
              "geometry_msgs/Vector3"};
    case MessageType::kTransforms:
      break;
  }
  return {"tf2_msgs/TFMessage",      "geometry_msgs/TransformStamped", "std_msgs/Header",
          "geometry_msgs/Transform", "geometry_msgs/Vector3",          "geometry_msgs/Quaternion"};
}

const Definition& definition(std::string_view name) {
  for (const Definition& known : kDefinitions) {
    if (known.name == name) return known;
  }
  return kDefinitions.front();
}

std::string joined(MessageType type, bool is_ros2) {
  std::vector<std::string_view> types = types_of(type);
  if (is_ros2) types.push_back("builtin_interfaces/Time");
  std::string text;
  for (const std::string_view name : types) {
    if (!text.empty()) {
      text += std::string(80, '=') + "\nMSG: " + std::string(name) + '\n';
    }
    const Definition& known = definition(name);
    text += is_ros2 && !known.ros2_fields.empty() ? known.ros2_fields : known.fields;
  }
  return text;
}

}  // namespace

std::string_view ros1_name(MessageType type) { return types_of(type).front(); }

std::string ros2_name(MessageType type) {
  std::string name(ros1_name(type));
  return name.insert(name.find('/'), "/msg");
}

std::string_view ros1_md5(MessageType type) {
  switch (type) {
    case MessageType::kPointCloud2:
      return "1158d486dd51d683ce2f1be655c3c181";
    case MessageType::kOdometry:
      return "cd5e73d190d741a2f92e81eda573aca7";
    case MessageType::kImu:
      return "6a62c6daae103f4ff57a132d6f95cec2";
    case MessageType::kTransforms:
      break;
  }
  return "94810edda583a504dfda3829e70d7eec";
}

std::string ros1_definition(MessageType type) { return joined(type, false); }

std::string ros2_definition(MessageType type) { return joined(type, true); }

}  // namespace unimapper::bags
