// Seeds of the fuzz target of bags: fuzz_bags_seeds FOLDER.
//
// Every kind of message in every serialization, and an MCAP file of them without compression and
// checksums, which changed bytes would fail.
#include "ports/datasets/bag/messages.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/ports/datasets/bag/mcap_file.hpp"
#include "tests/ports/datasets/bag/message_writer.hpp"

using namespace unimapper;
using namespace unimapper::datasets::bag;

namespace {

constexpr std::int64_t kStamp_ns = 100'000'000'000;

void write(const std::filesystem::path& file, const std::string& bytes) {
  fuzz::write_seed(file, {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
}

std::string cloud(Encoding encoding, std::int64_t stamp_ns) {
  CloudOfMessage points = plain_cloud({});
  points.width = 2;
  points.fields.push_back({"intensity", 12, 7});
  points.fields.push_back({"t", 16, 6});
  points.fields.push_back({"ring", 20, 4});
  points.point_step = 22;
  points.row_step = 44;
  for (const std::uint32_t time_ns : {0U, 90'000'000U}) {
    points.data += packed(1.0F, 2.0F, 3.0F, 4.0F, time_ns, std::uint16_t{5});
  }
  return cloud_message(encoding, stamp_ns, points);
}

std::string livox(Encoding encoding) {
  MessageWriter writer(encoding);
  writer.header(kStamp_ns, "lidar").number(std::uint64_t{kStamp_ns}).number(std::uint32_t{1});
  writer.raw(std::string(4, '\0')).number(std::uint32_t{1}).number(std::uint32_t{5});
  for (const float value : {1.0F, 2.0F, 3.0F}) writer.number(value);
  return writer.raw("abc").bytes();
}

std::string message(Encoding encoding, MessageKind kind) {
  switch (kind) {
    case MessageKind::kPointCloud:
      return cloud(encoding, kStamp_ns);
    case MessageKind::kLivox:
      return livox(encoding);
    case MessageKind::kOdometry:
      return odometry_message(encoding, kStamp_ns, Pose());
    case MessageKind::kTransforms:
      return transforms_message(encoding, {{kStamp_ns, "a", "b", Pose()}});
    case MessageKind::kFix:
      return fix_message(encoding, kStamp_ns, {});
    case MessageKind::kImu:
      return imu_message(encoding, kStamp_ns, {0.1, 0.2, 0.3});
    default:
      return pose_message(encoding, kStamp_ns, Pose());
  }
}

std::string recording(bool has_summary) {
  McapFile file(McapFile::Checksums::kNone);
  const auto points = file.topic("/points", "sensor_msgs/msg/PointCloud2");
  const auto odometry = file.topic("/odom", "nav_msgs/msg/Odometry");
  const auto transforms = file.topic("/tf", "tf2_msgs/msg/TFMessage");
  const auto fixes = file.topic("/fix", "sensor_msgs/msg/NavSatFix");
  const auto imu = file.topic("/imu", "sensor_msgs/msg/Imu");
  constexpr Encoding kCdr = Encoding::kCdrLittle;
  for (int i = 0; i < 3; ++i) {
    const std::int64_t stamp_ns = kStamp_ns + i * 100'000'000;
    file.message(transforms, stamp_ns,
                 transforms_message(kCdr, {{stamp_ns, "base_link", "lidar", Pose()}}));
    file.message(odometry, stamp_ns, odometry_message(kCdr, stamp_ns, Pose()));
    file.message(fixes, stamp_ns, fix_message(kCdr, stamp_ns, {}));
    file.message(imu, stamp_ns, imu_message(kCdr, stamp_ns, {0.1, 0.2, 0.3}));
    file.message(points, stamp_ns, cloud(kCdr, stamp_ns));
    file.end_chunk();
  }
  return file.bytes(has_summary);
}

void write_all(const std::filesystem::path& folder) {
  for (std::uint8_t kind = 0; kind < 9; ++kind) {
    for (const Encoding encoding : kEncodings) {
      const int serialization = encoding == Encoding::kRos1 ? 0 : 1;
      const auto choice = static_cast<char>(2 * kind + serialization);
      write(folder / ("message_" + std::to_string(kind) + "_" +
                      std::to_string(static_cast<int>(encoding))),
            choice + message(encoding, static_cast<MessageKind>(kind)));
    }
  }
  write(folder / "indexed.mcap", recording(true));
  write(folder / "not_indexed.mcap", recording(false));
}

}  // namespace

int main(int argc, char** argv) { return fuzz::write_seeds(argc, argv, write_all); }
