#include "ports/datasets/bag/messages.hpp"

#include <array>
#include <utility>

#include "ports/datasets/bag/message_reader.hpp"
#include "ports/datasets/poses.hpp"

namespace unimapper::datasets::bag {

MessageKind kind_of(std::string_view type) {
  constexpr std::array<std::pair<std::string_view, MessageKind>, 13> kKinds = {{
      {"sensor_msgs/PointCloud2", MessageKind::kPointCloud},
      {"livox_ros_driver/CustomMsg", MessageKind::kLivox},
      {"livox_ros_driver2/CustomMsg", MessageKind::kLivox},
      {"livox_interfaces/CustomMsg", MessageKind::kLivox},
      {"nav_msgs/Path", MessageKind::kPath},
      {"nav_msgs/Odometry", MessageKind::kOdometry},
      {"geometry_msgs/PoseStamped", MessageKind::kPose},
      {"geometry_msgs/PoseWithCovarianceStamped", MessageKind::kPoseWithCovariance},
      {"geometry_msgs/TransformStamped", MessageKind::kTransform},
      {"tf2_msgs/TFMessage", MessageKind::kTransforms},
      {"tf/tfMessage", MessageKind::kTransforms},
      {"sensor_msgs/NavSatFix", MessageKind::kFix},
      {"sensor_msgs/Imu", MessageKind::kImu},
  }};
  for (const auto& [name, kind] : kKinds) {
    if (name == type) return kind;
  }
  return MessageKind::kOther;
}

bool is_scan(MessageKind kind) {
  return kind == MessageKind::kPointCloud || kind == MessageKind::kLivox;
}

bool is_pose(MessageKind kind) {
  return kind == MessageKind::kOdometry || kind == MessageKind::kPose ||
         kind == MessageKind::kPoseWithCovariance || kind == MessageKind::kTransform;
}

namespace {

std::string frame_name(std::string_view name) {
  while (name.starts_with('/')) name.remove_prefix(1);
  return std::string(name);
}

Eigen::Vector3d read_vector(MessageReader& reader) {
  Eigen::Vector3d v;
  for (double& value : v) value = reader.number<double>();
  return v;
}

/// A position and a quaternion x y z w: geometry_msgs/Pose and geometry_msgs/Transform alike.
std::optional<Pose> read_pose(MessageReader& reader) {
  const Eigen::Vector3d t = read_vector(reader);
  const Eigen::Vector3d q = read_vector(reader);
  return pose_from_quaternion(t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), reader.number<double>());
}

}  // namespace

MessageHeader read_header(MessageReader& reader) {
  if (reader.is_ros1()) (void)reader.number<std::uint32_t>();  // seq
  const auto seconds = reader.number<std::uint32_t>();
  const auto nanoseconds = reader.number<std::uint32_t>();
  MessageHeader header;
  header.stamp_ns = std::int64_t{seconds} * kNanosecondsPerSecond + nanoseconds;
  header.frame = frame_name(reader.text());
  return header;
}

MessageHeader decode_header(std::string_view bytes, Serialization serialization) {
  MessageReader reader(bytes, serialization);
  return read_header(reader);
}

std::uint8_t decode_lidar_number(std::string_view bytes, Serialization serialization,
                                 MessageKind kind) {
  if (kind != MessageKind::kLivox) return 0;
  MessageReader reader(bytes, serialization);
  (void)read_header(reader);
  (void)reader.number<std::uint64_t>();  // time base
  (void)reader.number<std::uint32_t>();  // number of points
  return reader.number<std::uint8_t>();
}

std::vector<PoseMessage> decode_poses(std::string_view bytes, Serialization serialization,
                                      MessageKind kind) {
  MessageReader reader(bytes, serialization);
  // Stamp, a string's length, seven doubles.
  constexpr std::size_t kLeastPoseBytes = 3 * 4 + 7 * 8;
  std::string frame_of_path;
  if (kind == MessageKind::kPath) frame_of_path = read_header(reader).frame;
  const bool is_sequence = kind == MessageKind::kTransforms || kind == MessageKind::kPath;
  const std::uint32_t count = is_sequence ? reader.count(kLeastPoseBytes) : 1;
  const bool has_child = kind == MessageKind::kTransforms || kind == MessageKind::kTransform ||
                         kind == MessageKind::kOdometry;
  std::vector<PoseMessage> poses(count);
  for (PoseMessage& pose : poses) {
    pose.header = read_header(reader);
    if (pose.header.frame.empty()) pose.header.frame = frame_of_path;
    if (has_child) pose.child_frame = frame_name(reader.text());
    pose.pose = read_pose(reader);
  }
  return poses;
}

FixMessage decode_fix(std::string_view bytes, Serialization serialization) {
  MessageReader reader(bytes, serialization);
  FixMessage fix;
  fix.header = read_header(reader);
  fix.status = reader.number<std::int8_t>();
  (void)reader.number<std::uint16_t>();  // which satellites
  fix.latitude_deg = reader.number<double>();
  fix.longitude_deg = reader.number<double>();
  fix.height_m = reader.number<double>();
  for (std::size_t i = 0; i < 9; ++i) {
    const auto covariance = reader.number<double>();
    if (i % 4 == 0) fix.variances[i / 4] = covariance;
  }
  fix.has_variances = reader.number<std::uint8_t>() != 0;
  return fix;
}

ImuMessage decode_imu(std::string_view bytes, Serialization serialization) {
  MessageReader reader(bytes, serialization);
  ImuMessage message;
  message.header = read_header(reader);
  constexpr int kOrientation = 4 + 9;  // and its covariance
  for (int i = 0; i < kOrientation; ++i) (void)reader.number<double>();
  const Eigen::Vector3d rad_s = read_vector(reader);
  constexpr double kNone = -1.0;  // first of the covariance
  if (reader.number<double>() != kNone && rad_s.allFinite()) message.rad_s = rad_s;
  for (int i = 1; i < 9; ++i) (void)reader.number<double>();
  const Eigen::Vector3d acceleration = read_vector(reader);
  if (reader.number<double>() != kNone && acceleration.allFinite()) {
    message.acceleration = acceleration;
  }
  return message;
}

}  // namespace unimapper::datasets::bag
