// Decoders of the ROS messages that a map is made of.
//
// ROS 1 and ROS 2 write the same fields; the header's `seq` alone is ROS 1's. All decoders throw
// DatasetError (without naming a file) where a message is too short or its values cannot be.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ports/datasets/bag/message_source.hpp"
#include "ports/datasets/dataset.hpp"
#include "ports/datasets/point_clock.hpp"

namespace unimapper::datasets::bag {

/// Kinds of messages that are read.
enum class MessageKind : std::uint8_t {
  kPointCloud,          ///< sensor_msgs/PointCloud2
  kLivox,               ///< livox_ros_driver/CustomMsg, livox_ros_driver2/CustomMsg
  kOdometry,            ///< nav_msgs/Odometry
  kPose,                ///< geometry_msgs/PoseStamped
  kPoseWithCovariance,  ///< geometry_msgs/PoseWithCovarianceStamped
  kTransform,           ///< geometry_msgs/TransformStamped
  kTransforms,          ///< tf2_msgs/TFMessage, tf/tfMessage
  kPath,                ///< nav_msgs/Path
  kFix,                 ///< sensor_msgs/NavSatFix
  kImu,                 ///< sensor_msgs/Imu
  kOther,
};

/// The kind of a type named as ROS 1 does.
MessageKind kind_of(std::string_view type);

/// True for the kinds that hold the points of a scan.
bool is_scan(MessageKind kind);
/// True for the kinds that hold one pose of the robot.
bool is_pose(MessageKind kind);

/// std_msgs/Header.
struct MessageHeader {
  /// Nanoseconds.
  std::int64_t stamp_ns = 0;
  std::string frame;  ///< without ROS 1's leading slash
};

class MessageReader;
/// Takes the header that a message begins with.
MessageHeader read_header(MessageReader& reader);

/// The header that a message begins with; `bytes` may end behind it.
MessageHeader decode_header(std::string_view bytes, Serialization serialization);
/// The number that a Livox message gives its LiDAR, 0 of other kinds; `bytes` may end behind it.
std::uint8_t decode_lidar_number(std::string_view bytes, Serialization serialization,
                                 MessageKind kind);
/// That many bytes hold the header of any sensible message.
inline constexpr std::size_t kHeaderBytes = 512;

/// A pose with its frames: T_frame_child at a stamp.
struct PoseMessage {
  /// Stamp and parent frame.
  MessageHeader header;
  std::string child_frame;   ///< empty where the message has none
  std::optional<Pose> pose;  ///< empty where it is not finite or its quaternion is none
};

/// The pose of an odometry, pose or transform message, the poses of several transforms or a path.
std::vector<PoseMessage> decode_poses(std::string_view bytes, Serialization serialization,
                                      MessageKind kind);

/// sensor_msgs/NavSatFix, as it is.
struct FixMessage {
  /// Stamp and frame of the antenna.
  MessageHeader header;
  std::int8_t status = 0;             ///< negative: no fix
  double latitude_deg = 0.0;          ///< may be any number, as all below
  double longitude_deg = 0.0;         ///< east
  double height_m = 0.0;              ///< above the ellipsoid WGS84
  std::array<double, 3> variances{};  ///< of east, north and up, square metres
  bool has_variances = false;         ///< the message says that they are known
};

/// The fix of a message.
FixMessage decode_fix(std::string_view bytes, Serialization serialization);

/// What an IMU measured.
struct ImuMessage {
  /// Stamp and the frame whose axes are meant.
  MessageHeader header;
  /// Empty where it is not finite, or the message says that it has none.
  std::optional<Eigen::Vector3d> rad_s;
  /// In m/s² or g, at rest along up; zero where it is not finite, or there is none.
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();
};

/// Angular velocity and acceleration of a message of kind `kImu`.
ImuMessage decode_imu(std::string_view bytes, Serialization serialization);

/// How the points of a topic are read: the same for all its messages, found in one of them.
struct ScanLayout {
  std::string description;          ///< of the fields used, e.g. "x y z intensity t ring"
  std::string all_fields;           ///< a blank before each
  bool are_bytes_swapped = false;   ///< against what the message says of their order
  double unread_share = 0.0;        ///< of its bytes, which are of no point
  bool has_time_field = false;      ///< though it may tell nothing
  std::optional<PointClock> clock;  ///< empty: no time per point
  TimeRange times;                  ///< of the scan that it was found in, in units of `clock`
  std::uint32_t laser_rows = 0;     ///< rows of an organised cloud, where each is a laser's
};

/// Layout of a scan message (see `is_scan`). The unit of time follows from the numbers: points of
/// one scan are 2 ms to 2 s apart, which is true of one unit only. Rows are lasers where their
/// elevations are apart from each other. `log_time_ns` stands for a stamp of 0.
ScanLayout find_layout(std::string_view bytes, Serialization serialization, MessageKind kind,
                       std::int64_t log_time_ns = 0);

/// Points of a scan message. Points that are not finite or lie at the origin (no return) are left
/// out; the number of those is returned. `log_time_ns` stands for a stamp of 0.
std::size_t decode_scan(std::string_view bytes, Serialization serialization, MessageKind kind,
                        const ScanLayout& layout, Scan& scan, std::int64_t log_time_ns = 0);

}  // namespace unimapper::datasets::bag
