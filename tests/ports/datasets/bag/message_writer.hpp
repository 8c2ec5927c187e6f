// ROS messages as bytes, made by hand from the definitions of their serializations.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "ports/datasets/bag/message_source.hpp"
#include "unimapper/core/pose.hpp"

namespace unimapper::datasets::bag {

/// The three ways in which a message may be written.
enum class Encoding : std::uint8_t { kRos1, kCdrLittle, kCdrBig };
inline constexpr std::array<Encoding, 3> kEncodings = {Encoding::kRos1, Encoding::kCdrLittle,
                                                       Encoding::kCdrBig};

inline Serialization serialization_of(Encoding encoding) {
  return encoding == Encoding::kRos1 ? Serialization::kRos1 : Serialization::kCdr;
}

class MessageWriter {
 public:
  explicit MessageWriter(Encoding encoding) : encoding_(encoding) {
    if (encoding == Encoding::kRos1) return;
    bytes_ = {0, encoding == Encoding::kCdrLittle ? '\1' : '\0', 0, 0};
  }

  template <typename T>
  MessageWriter& number(T value) {
    if (encoding_ != Encoding::kRos1) {
      while ((bytes_.size() - 4) % sizeof(T) != 0) bytes_ += '\0';
    }
    auto bytes = std::bit_cast<std::array<char, sizeof(T)>>(value);
    if (encoding_ == Encoding::kCdrBig) std::reverse(bytes.begin(), bytes.end());
    bytes_.append(bytes.data(), bytes.size());
    return *this;
  }

  MessageWriter& text(std::string_view value) {
    const bool has_end = encoding_ != Encoding::kRos1;
    number(static_cast<std::uint32_t>(value.size() + (has_end ? 1 : 0)));
    bytes_ += value;
    if (has_end) bytes_ += '\0';
    return *this;
  }

  MessageWriter& raw(std::string_view value) {
    bytes_ += value;
    return *this;
  }

  MessageWriter& header(std::int64_t stamp_ns, std::string_view frame) {
    if (encoding_ == Encoding::kRos1) number(std::uint32_t{7});  // seq
    number(static_cast<std::uint32_t>(stamp_ns / 1'000'000'000));
    number(static_cast<std::uint32_t>(stamp_ns % 1'000'000'000));
    return text(frame);
  }

  MessageWriter& pose(const Pose& pose) {
    for (const double value : pose.translation) number(value);
    const Eigen::Quaterniond q = pose.quaternion();
    return number(q.x()).number(q.y()).number(q.z()).number(q.w());
  }

  [[nodiscard]] const std::string& bytes() const { return bytes_; }
  [[nodiscard]] Encoding encoding() const { return encoding_; }

 private:
  Encoding encoding_;
  std::string bytes_;
};

/// nav_msgs/Odometry with a still robot.
inline std::string odometry_message(Encoding encoding, std::int64_t stamp_ns, const Pose& pose,
                                    std::string_view frame = "odom",
                                    std::string_view child = "base_link") {
  MessageWriter writer(encoding);
  writer.header(stamp_ns, frame).text(child).pose(pose);
  for (int i = 0; i < 36 + 6 + 36; ++i) writer.number(0.0);
  return writer.bytes();
}

/// geometry_msgs/PoseStamped.
inline std::string pose_message(Encoding encoding, std::int64_t stamp_ns, const Pose& pose,
                                std::string_view frame = "map") {
  return MessageWriter(encoding).header(stamp_ns, frame).pose(pose).bytes();
}

/// sensor_msgs/NavSatFix but for its header.
struct FixOfMessage {
  std::int8_t status = 0;
  double latitude_deg = 48.1;
  double longitude_deg = 11.5;
  double height_m = 520.0;
  double sigma_m = 0.5;  ///< of each axis
  std::uint8_t covariance_type = 2;
};

inline std::string fix_message(Encoding encoding, std::int64_t stamp_ns, const FixOfMessage& fix,
                               std::string_view frame = "gps") {
  MessageWriter writer(encoding);
  writer.header(stamp_ns, frame).number(fix.status).number(std::uint16_t{1});
  writer.number(fix.latitude_deg).number(fix.longitude_deg).number(fix.height_m);
  for (int i = 0; i < 9; ++i) writer.number(i % 4 == 0 ? fix.sigma_m * fix.sigma_m : 0.0);
  return writer.number(fix.covariance_type).bytes();
}

/// sensor_msgs/Imu without an orientation; `first_covariance` is -1 without angular velocity.
inline std::string imu_message(Encoding encoding, std::int64_t stamp_ns,
                               const Eigen::Vector3d& rad_s, std::string_view frame = "lidar",
                               double first_covariance = 0.0,
                               const Eigen::Vector3d& acceleration = Eigen::Vector3d::Zero(),
                               double first_of_acceleration = 0.0) {
  MessageWriter writer(encoding);
  writer.header(stamp_ns, frame);
  for (int i = 0; i < 4; ++i) writer.number(0.0);
  writer.number(-1.0);
  for (int i = 1; i < 9; ++i) writer.number(0.0);
  for (const double value : rad_s) writer.number(value);
  writer.number(first_covariance);
  for (int i = 1; i < 9; ++i) writer.number(0.0);
  for (const double value : acceleration) writer.number(value);
  writer.number(first_of_acceleration);
  for (int i = 1; i < 9; ++i) writer.number(0.0);
  return writer.bytes();
}

struct TransformOfMessage {
  std::int64_t stamp_ns;
  std::string parent;
  std::string child;
  Pose T_parent_child;
};

/// tf2_msgs/TFMessage.
inline std::string transforms_message(Encoding encoding,
                                      const std::vector<TransformOfMessage>& transforms) {
  MessageWriter writer(encoding);
  writer.number(static_cast<std::uint32_t>(transforms.size()));
  for (const TransformOfMessage& transform : transforms) {
    writer.header(transform.stamp_ns, transform.parent).text(transform.child);
    writer.pose(transform.T_parent_child);
  }
  return writer.bytes();
}

/// One field of a point cloud: name, offset, type as sensor_msgs/PointField numbers it.
struct FieldOfMessage {
  std::string name;
  std::uint32_t offset;
  std::uint8_t type;
};

/// sensor_msgs/PointCloud2 but for its header.
struct CloudOfMessage {
  std::uint32_t height = 1;
  std::uint32_t width = 0;
  std::vector<FieldOfMessage> fields;
  bool is_big_endian = false;
  std::uint32_t point_step = 0;
  std::uint32_t row_step = 0;
  std::string data;
};

inline std::string cloud_message(Encoding encoding, std::int64_t stamp_ns,
                                 const CloudOfMessage& cloud, std::string_view frame = "lidar") {
  MessageWriter writer(encoding);
  writer.header(stamp_ns, frame).number(cloud.height).number(cloud.width);
  writer.number(static_cast<std::uint32_t>(cloud.fields.size()));
  for (const FieldOfMessage& field : cloud.fields) {
    writer.text(field.name).number(field.offset).number(field.type).number(std::uint32_t{1});
  }
  writer.number(static_cast<std::uint8_t>(cloud.is_big_endian ? 1 : 0));
  writer.number(cloud.point_step).number(cloud.row_step);
  writer.number(static_cast<std::uint32_t>(cloud.data.size())).raw(cloud.data);
  writer.number(std::uint8_t{0});  // is_dense
  return writer.bytes();
}

/// The bytes of numbers one after another, little endian.
template <typename... Numbers>
std::string packed(Numbers... numbers) {
  std::string bytes;
  (bytes.append(std::bit_cast<std::array<char, sizeof numbers>>(numbers).data(), sizeof numbers),
   ...);
  return bytes;
}

/// A cloud of x y z (float) points.
inline CloudOfMessage plain_cloud(const std::vector<Eigen::Vector3f>& points) {
  CloudOfMessage cloud;
  cloud.width = static_cast<std::uint32_t>(points.size());
  cloud.fields = {{"x", 0, 7}, {"y", 4, 7}, {"z", 8, 7}};
  cloud.point_step = 12;
  cloud.row_step = 12 * cloud.width;
  for (const Eigen::Vector3f& p : points) cloud.data += packed(p.x(), p.y(), p.z());
  return cloud;
}

}  // namespace unimapper::datasets::bag
