#include "ports/bag_writers/foxglove_writer.hpp"

#include <nlohmann/json.hpp>

#include "ports/bag_writers/byte_buffer.hpp"
#include "ports/bag_writers/encoding.hpp"
#include "ports/bag_writers/message_definitions.hpp"

namespace unimapper::bags {
namespace {

using Json = nlohmann::ordered_json;

Json time(std::int64_t stamp_ns) {
  constexpr std::int64_t kPerSecond = 1'000'000'000;
  return {{"sec", stamp_ns / kPerSecond}, {"nsec", stamp_ns % kPerSecond}};
}

Json vector(const Eigen::Vector3d& v) { return {{"x", v.x()}, {"y", v.y()}, {"z", v.z()}}; }

Json quaternion(const Pose& pose) {
  const Eigen::Quaterniond q = pose.quaternion();
  return {{"x", q.x()}, {"y", q.y()}, {"z", q.z()}, {"w", q.w()}};
}

Json json(const Pose& pose) {
  return {{"position", vector(pose.translation)}, {"orientation", quaternion(pose)}};
}

Json json(const Rgba& color) {
  const auto share = [](std::uint8_t value) { return value / 255.0; };
  return {{"r", share(color.red)},
          {"g", share(color.green)},
          {"b", share(color.blue)},
          {"a", share(color.alpha)}};
}

}  // namespace

FoxgloveWriter::FoxgloveWriter(const std::filesystem::path& file) : writer_(file, "") {}

void FoxgloveWriter::write(std::string_view topic, FoxgloveSchema schema, std::int64_t stamp_ns,
                           std::string_view message) {
  const auto [known, is_new] = schemas_.try_emplace(schema, std::uint16_t{0});
  if (is_new) {
    known->second = writer_.add_schema(schema_name(schema), "jsonschema", schema_text(schema));
  }
  write(topic, known->second, "json", stamp_ns, message);
}

void FoxgloveWriter::write(std::string_view topic, std::uint16_t schema, std::string_view encoding,
                           std::int64_t stamp_ns, std::string_view message) {
  auto channel = channels_.find(topic);
  if (channel == channels_.end()) {
    channel =
        channels_.emplace(std::string(topic), writer_.add_channel(schema, topic, encoding)).first;
  }
  writer_.write(channel->second, static_cast<std::uint64_t>(stamp_ns), message);
}

void FoxgloveWriter::write_cloud(std::string_view topic, std::string_view frame,
                                 std::int64_t stamp_ns, std::span<const Eigen::Vector3f> points,
                                 std::optional<Rgba> color,
                                 std::span<const std::uint8_t> intensities) {
  constexpr MessageType kType = MessageType::kPointCloud2;
  if (cloud_schema_ == 0) {
    cloud_schema_ = writer_.add_schema(ros2_name(kType), "ros2msg", ros2_definition(kType));
  }
  std::vector<PointField> fields = {{"x", 0, PointField::kFloat32},
                                    {"y", 4, PointField::kFloat32},
                                    {"z", 8, PointField::kFloat32}};
  std::uint32_t point_bytes = 12;
  const auto add = [&](const char* name, PointField::Type type, std::uint32_t bytes) {
    fields.push_back({name, point_bytes, type});
    point_bytes += bytes;
  };
  if (color) add("rgba", PointField::kUint32, 4);
  const bool has_intensities = !points.empty() && intensities.size() == points.size();
  if (has_intensities) add("intensity", PointField::kUint8, 1);
  ByteBuffer data;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (const float coordinate : points[i]) data.put(coordinate);
    if (color) {
      for (const std::uint8_t value : {color->blue, color->green, color->red, color->alpha}) {
        data.put(value);
      }
    }
    if (has_intensities) data.put(intensities[i]);
  }
  const PackedCloud cloud{{stamp_ns, std::string(frame)}, fields, point_bytes, data.view()};
  write(topic, cloud_schema_, "cdr", stamp_ns, encode(Encoding::kCdr, cloud));
}

void FoxgloveWriter::write_poses(std::string_view topic, std::string_view frame,
                                 std::int64_t stamp_ns, std::span<const Pose> poses) {
  Json list = Json::array();
  for (const Pose& pose : poses) list.push_back(json(pose));
  const Json message = {
      {"timestamp", time(stamp_ns)}, {"frame_id", frame}, {"poses", std::move(list)}};
  write(topic, FoxgloveSchema::kPosesInFrame, stamp_ns, message.dump());
}

void FoxgloveWriter::write_pose(std::string_view topic, std::string_view frame,
                                std::int64_t stamp_ns, const Pose& pose) {
  const Json message = {{"timestamp", time(stamp_ns)}, {"frame_id", frame}, {"pose", json(pose)}};
  write(topic, FoxgloveSchema::kPoseInFrame, stamp_ns, message.dump());
}

void FoxgloveWriter::write_transform(std::string_view parent, std::string_view child,
                                     std::int64_t stamp_ns, const Pose& transform) {
  const Json message = {{"timestamp", time(stamp_ns)},
                        {"parent_frame_id", parent},
                        {"child_frame_id", child},
                        {"translation", vector(transform.translation)},
                        {"rotation", quaternion(transform)}};
  write("/tf", FoxgloveSchema::kFrameTransform, stamp_ns, message.dump());
}

void FoxgloveWriter::write_lines(std::string_view topic, std::string_view frame,
                                 std::int64_t stamp_ns, std::string_view id,
                                 std::span<const std::pair<Eigen::Vector3d, Eigen::Vector3d>> lines,
                                 const Rgba& color) {
  constexpr int kLineList = 2;
  Json points = Json::array();
  for (const auto& [from, to] : lines) {
    points.push_back(vector(from));
    points.push_back(vector(to));
  }
  const Json none = Json::array();
  const Json line = {{"type", kLineList},
                     {"pose", json(Pose())},
                     {"thickness", 2.0},
                     {"scale_invariant", true},
                     {"points", std::move(points)},
                     {"color", json(color)},
                     {"colors", none},
                     {"indices", none}};
  const Json entity = {{"timestamp", time(stamp_ns)},
                       {"frame_id", frame},
                       {"id", id},
                       {"lifetime", {{"sec", 0}, {"nsec", 0}}},
                       {"frame_locked", false},
                       {"metadata", none},
                       {"arrows", none},
                       {"cubes", none},
                       {"spheres", none},
                       {"cylinders", none},
                       {"lines", Json::array({line})},
                       {"triangles", none},
                       {"texts", none},
                       {"models", none}};
  const Json message = {{"deletions", none}, {"entities", Json::array({entity})}};
  write(topic, FoxgloveSchema::kSceneUpdate, stamp_ns, message.dump());
}

}  // namespace unimapper::bags
