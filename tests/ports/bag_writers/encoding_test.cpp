// Tests of the serialisation of ROS messages, against bytes laid out by hand.
#include "ports/bag_writers/encoding.hpp"

#include "ports/bag_writers/byte_buffer.hpp"
#include "ports/bag_writers/message_definitions.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::bags;

namespace {

using namespace std::string_literals;

constexpr std::int64_t kStamp_ns = 1'700'000'000'250'000'000;

Pose quarter_turn() {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(std::acos(-1.0) / 2.0, Eigen::Vector3d::UnitZ())),
          {1.0, 2.0, 3.0}};
}

/// Bytes that a message is expected to have.
struct Expected : ByteBuffer {
  void put_numbers(std::initializer_list<std::uint32_t> numbers) {
    for (const std::uint32_t number : numbers) put(number);
  }
  void put_doubles(std::initializer_list<double> numbers) {
    for (const double number : numbers) put(number);
  }
  void put_stamp() { put_numbers({1'700'000'000, 250'000'000}); }
  void put_quarter_turn() {
    const Eigen::Quaterniond q = quarter_turn().quaternion();
    put_doubles({1.0, 2.0, 3.0, q.x(), q.y(), q.z(), q.w()});
  }
};

}  // namespace

TEST_CASE("a transform of ROS 1 is packed and numbered") {
  const Transforms transforms = {{{kStamp_ns, "odom"}, "base", quarter_turn()}};
  Expected expected;
  expected.put_numbers({1, 7});  // transforms, sequence
  expected.put_stamp();
  expected.put_text("odom");
  expected.put_text("base");
  expected.put_quarter_turn();
  CHECK((encode(Encoding::kRos1, transforms, 7) == expected.view()));
}

TEST_CASE("a transform of CDR has aligned numbers, and texts that end in zero") {
  const Transforms transforms = {{{kStamp_ns, "odom"}, "base", quarter_turn()}};
  Expected expected;
  expected.put_bytes("\0\1\0\0"s);        // little-endian CDR
  expected.put_numbers({1});              // 0: transforms
  expected.put_stamp();                   // 4
  expected.put_text("odom\0"s);           // 12 to 21
  expected.put_bytes("\0\0\0"s);          // 24
  expected.put_text("base\0"s);           // 24 to 33
  expected.put_bytes("\0\0\0\0\0\0\0"s);  // 40
  expected.put_quarter_turn();
  CHECK((encode(Encoding::kCdr, transforms) == expected.view()));
}

TEST_CASE("an odometry ends with the covariance of its velocities") {
  Odometry odometry{{kStamp_ns, "odom"}, "base", quarter_turn()};
  odometry.velocity = {4.0, 5.0, 6.0};
  odometry.turn_rate = {7.0, 8.0, 9.0};
  Expected expected;
  expected.put_numbers({0});
  expected.put_stamp();
  expected.put_text("odom");
  expected.put_text("base");
  expected.put_quarter_turn();
  for (int i = 0; i < 36; ++i) expected.put(0.0);
  expected.put_doubles({4.0, 5.0, 6.0, 7.0, 8.0, 9.0});
  for (int i = 0; i < 36; ++i) expected.put(0.0);
  CHECK((encode(Encoding::kRos1, odometry) == expected.view()));
}

TEST_CASE("an IMU says that it has no orientation") {
  Expected expected;
  expected.put_numbers({0});
  expected.put_stamp();
  expected.put_text("base");
  expected.put_doubles({0.0, 0.0, 0.0, 0.0, -1.0});
  for (int i = 1; i < 9; ++i) expected.put(0.0);
  expected.put_doubles({1.0, 2.0, 3.0});
  for (int i = 0; i < 9 + 3 + 9; ++i) expected.put(0.0);
  CHECK((encode(Encoding::kRos1, Imu{{kStamp_ns, "base"}, {1.0, 2.0, 3.0}}) == expected.view()));
}

TEST_CASE("a point cloud describes its fields") {
  const CloudPoint point{1.5F, -2.5F, 3.5F, 0.25F, 17, -0.0625F};
  const PointCloud2 cloud{{kStamp_ns, "lidar"}, {&point, 1}};
  const bool is_cdr = GENERATE(false, true);
  Expected expected;
  const std::string end = is_cdr ? "\0"s : ""s;
  const auto fill = [&](std::size_t zeros) {
    if (is_cdr) expected.put_bytes(std::string(zeros, '\0'));
  };
  expected.put_bytes(is_cdr ? "\0\1\0\0"s : "\0\0\0\0"s);
  expected.put_stamp();
  expected.put_text("lidar" + end);
  fill(2);
  expected.put_numbers({1, 1, 6});  // height, width, fields
  struct Field {
    std::string name;
    std::uint32_t offset;
    std::uint8_t type;
    std::size_t fill_after_name;
  };
  for (const Field& field :
       {Field{"x", 0, 7, 2}, Field{"y", 4, 7, 2}, Field{"z", 8, 7, 2}, Field{"intensity", 12, 7, 2},
        Field{"ring", 16, 4, 3}, Field{"time", 18, 7, 3}}) {
    expected.put_text(field.name + end);
    fill(field.fill_after_name);
    expected.put(field.offset);
    expected.put(field.type);
    fill(3);
    expected.put_numbers({1});
  }
  expected.put(std::uint8_t{0});
  fill(3);
  expected.put_numbers({22, 22, 22});
  for (const float value : {1.5F, -2.5F, 3.5F, 0.25F}) expected.put(value);
  expected.put(std::uint16_t{17});
  expected.put(-0.0625F);
  expected.put(std::uint8_t{1});
  CHECK((encode(is_cdr ? Encoding::kCdr : Encoding::kRos1, cloud) == expected.view()));
}

TEST_CASE("a definition carries those of its types") {
  const std::string ros1 = ros1_definition(MessageType::kTransforms);
  CHECK(ros1.find("geometry_msgs/TransformStamped[] transforms\n====") == 0);
  CHECK(ros1.find("MSG: std_msgs/Header\nuint32 seq\ntime stamp\n") != std::string::npos);
  const std::string ros2 = ros2_definition(MessageType::kTransforms);
  CHECK(ros2.find("MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\n") != std::string::npos);
  CHECK(ros2.find("MSG: builtin_interfaces/Time\nint32 sec\n") != std::string::npos);
  CHECK(ros2_name(MessageType::kPointCloud2) == "sensor_msgs/msg/PointCloud2");
}
