#include "ports/bag_writers/encoding.hpp"

#include <array>
#include <string_view>

#include "ports/bag_writers/byte_buffer.hpp"

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
  void put_packed(const CloudPoint& point) {
    bytes_.put(point.x);
    bytes_.put(point.y);
    bytes_.put(point.z);
    bytes_.put(point.intensity);
    bytes_.put(point.ring);
    bytes_.put(point.time_s);
  }

  [[nodiscard]] std::string take() const { return std::string(bytes_.view()); }

 private:
  static constexpr std::size_t kCdrHeader = 4;
  ByteBuffer bytes_;
  bool is_cdr_;
  std::uint32_t sequence_;
};

/// sensor_msgs/PointField of `CloudPoint`.
struct Field {
  std::string_view name;
  std::uint32_t offset;
  std::uint8_t type;
};

constexpr std::uint8_t kUint16 = 4;
constexpr std::uint8_t kFloat32 = 7;
constexpr std::array<Field, 6> kFields = {{{"x", 0, kFloat32},
                                           {"y", 4, kFloat32},
                                           {"z", 8, kFloat32},
                                           {"intensity", 12, kFloat32},
                                           {"ring", 16, kUint16},
                                           {"time", 18, kFloat32}}};
constexpr std::uint32_t kPointBytes = 22;

}  // namespace

std::string encode(Encoding encoding, const PointCloud2& cloud, std::uint32_t sequence) {
  MessageBytes bytes(encoding, sequence);
  const auto count = static_cast<std::uint32_t>(cloud.points.size());
  bytes.put(cloud.header);
  bytes.put(std::uint32_t{1});  // height
  bytes.put(count);             // width
  bytes.put(static_cast<std::uint32_t>(kFields.size()));
  for (const Field& field : kFields) {
    bytes.put(field.name);
    bytes.put(field.offset);
    bytes.put(field.type);
    bytes.put(std::uint32_t{1});  // count
  }
  bytes.put(std::uint8_t{0});  // little endian
  bytes.put(kPointBytes);
  bytes.put(kPointBytes * count);  // bytes of a row
  bytes.put(kPointBytes * count);  // bytes of all
  for (const CloudPoint& point : cloud.points) bytes.put_packed(point);
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
