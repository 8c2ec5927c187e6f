#include "ports/bag_writers/encoding.hpp"

#include <array>
#include <string_view>

#include "ports/bag_writers/byte_buffer.hpp"
#include "ports/bag_writers/output_file.hpp"

namespace unimapper::bags {
namespace {

/// A message in the making.
class MessageBytes {
 public:
  MessageBytes(Encoding encoding, std::uint32_t sequence)
      : is_cdr_(encoding == Encoding::kCdr), sequence_(sequence) {
    if (is_cdr_) bytes_.put_bytes({"\0\1\0\0", kCdrHeader});
  }

  template <typename Number>
  void put(Number value) {
    // CDR counts from behind its own header.
    while (is_cdr_ && (bytes_.size() - kCdrHeader) % sizeof value != 0) bytes_.put('\0');
    bytes_.put(value);
  }
  void put(std::string_view text) {
    // CDR counts and writes the final zero.
    put(static_cast<std::uint32_t>(text.size() + (is_cdr_ ? 1 : 0)));
    bytes_.put_bytes(text);
    if (is_cdr_) bytes_.put('\0');
  }
  void put(const Header& header) {
    constexpr std::int64_t kPerSecond = 1'000'000'000;
    if (!is_cdr_) put(sequence_);
    put(static_cast<std::uint32_t>(header.stamp_ns / kPerSecond));
    put(static_cast<std::uint32_t>(header.stamp_ns % kPerSecond));
    put(std::string_view(header.frame_id));
  }
  void put(const Eigen::Vector3d& vector) {
    for (const double value : {vector.x(), vector.y(), vector.z()}) put(value);
  }
  /// geometry_msgs/Pose and geometry_msgs/Transform lie alike.
  void put(const Pose& pose) {
    put(pose.translation);
    const Eigen::Quaterniond q = pose.quaternion();
    for (const double value : {q.x(), q.y(), q.z(), q.w()}) put(value);
  }
  void put_covariance() {
    for (int i = 0; i < 36; ++i) put(0.0);
  }
  void put_packed(std::string_view bytes) { bytes_.put_bytes(bytes); }

  [[nodiscard]] std::string take() const { return std::string(bytes_.view()); }

 private:
  static constexpr std::size_t kCdrHeader = 4;
  ByteBuffer bytes_;
  bool is_cdr_;
  std::uint32_t sequence_;
};

/// Fields of `CloudPoint`.
constexpr std::array<PointField, 6> kFields = {{{"x", 0, PointField::kFloat32},
                                                {"y", 4, PointField::kFloat32},
                                                {"z", 8, PointField::kFloat32},
                                                {"intensity", 12, PointField::kFloat32},
                                                {"ring", 16, PointField::kUint16},
                                                {"time", 18, PointField::kFloat32}}};
constexpr std::uint32_t kPointBytes = 22;

}  // namespace

std::string encode(Encoding encoding, const PointCloud2& cloud, std::uint32_t sequence) {
  ByteBuffer points;
  for (const CloudPoint& point : cloud.points) {
    for (const float value : {point.x, point.y, point.z, point.intensity}) points.put(value);
    points.put(point.ring);
    points.put(point.time_s);
  }
  return encode(encoding, PackedCloud{cloud.header, kFields, kPointBytes, points.view()}, sequence);
}

std::string encode(Encoding encoding, const PackedCloud& cloud, std::uint32_t sequence) {
  if (cloud.points.size() > UINT32_MAX)
    throw BagError("a cloud of 4 GB does not fit into a message");
  MessageBytes bytes(encoding, sequence);
  const auto byte_count = static_cast<std::uint32_t>(cloud.points.size());
  bytes.put(cloud.header);
  bytes.put(std::uint32_t{1});                // height
  bytes.put(byte_count / cloud.point_bytes);  // width
  bytes.put(static_cast<std::uint32_t>(cloud.fields.size()));
  for (const PointField& field : cloud.fields) {
    bytes.put(field.name);
    bytes.put(field.offset);
    bytes.put(std::uint8_t{field.type});
    bytes.put(std::uint32_t{1});  // count
  }
  bytes.put(std::uint8_t{0});  // little endian
  bytes.put(cloud.point_bytes);
  bytes.put(byte_count);  // of a row
  bytes.put(byte_count);  // of all
  bytes.put_packed(cloud.points);
  bytes.put(std::uint8_t{1});  // every point is finite
  return bytes.take();
}

std::string encode(Encoding encoding, const Odometry& odometry, std::uint32_t sequence) {
  MessageBytes bytes(encoding, sequence);
  bytes.put(odometry.header);
  bytes.put(std::string_view(odometry.child_frame_id));
  bytes.put(odometry.pose);
  bytes.put_covariance();
  bytes.put(odometry.velocity);
  bytes.put(odometry.turn_rate);
  bytes.put_covariance();
  return bytes.take();
}

std::string encode(Encoding encoding, const Imu& imu, std::uint32_t sequence) {
  constexpr int kCovariance = 9;
  MessageBytes bytes(encoding, sequence);
  bytes.put(imu.header);
  for (int i = 0; i < 4; ++i) bytes.put(0.0);  // orientation
  bytes.put(-1.0);                             // of which there is none
  for (int i = 1; i < kCovariance; ++i) bytes.put(0.0);
  bytes.put(imu.angular_velocity);
  for (int i = 0; i < kCovariance; ++i) bytes.put(0.0);
  bytes.put(imu.linear_acceleration);
  for (int i = 0; i < kCovariance; ++i) bytes.put(0.0);
  return bytes.take();
}

std::string encode(Encoding encoding, const Transforms& transforms, std::uint32_t sequence) {
  MessageBytes bytes(encoding, sequence);
  bytes.put(static_cast<std::uint32_t>(transforms.size()));
  for (const Transform& transform : transforms) {
    bytes.put(transform.header);
    bytes.put(std::string_view(transform.child_frame_id));
    bytes.put(transform.transform);
  }
  return bytes.take();
}

}  // namespace unimapper::bags
