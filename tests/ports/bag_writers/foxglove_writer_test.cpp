// Tests of scenes in Foxglove's messages.
#include "ports/bag_writers/foxglove_writer.hpp"

#include <nlohmann/json.hpp>

#include "tests/ports/bag_writers/bytes.hpp"
#include "tests/temporary_directory.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::bags;

namespace {

/// A scene that `write` makes, as the bytes of its file.
template <typename Write>
std::string scene_of(const Write& write) {
  const TemporaryDirectory folder;
  FoxgloveWriter writer(folder / "scene.mcap");
  write(writer);
  writer.close();
  return read_bytes(folder / "scene.mcap");
}

/// The JSON object that begins where `file` first has `text`.
nlohmann::json object_with(const std::string& file, const std::string& text) {
  const std::size_t begin = file.find(text);
  if (begin == std::string::npos) return {};
  int depth = 0;
  for (std::size_t end = begin; end < file.size(); ++end) {
    depth += (file[end] == '{' ? 1 : 0) - (file[end] == '}' ? 1 : 0);
    if (depth == 0) return nlohmann::json::parse(file.substr(begin, end + 1 - begin));
  }
  return {};
}

}  // namespace

TEST_CASE("a cloud of a scene is a PointCloud2 of ROS 2 with one colour or none") {
  const std::vector<Eigen::Vector3f> points = {{1.0F, 2.0F, 3.0F}, {-4.0F, 5.5F, 0.0F}};
  const bool has_color = GENERATE(false, true);
  const std::string file = scene_of([&](FoxgloveWriter& writer) {
    writer.write_cloud("/static", "map", 3'000'000'005, points,
                       has_color ? std::optional<Rgba>({10, 20, 30, 40}) : std::nullopt);
  });
  CHECK(file.find("sensor_msgs/msg/PointCloud2") != std::string::npos);
  const std::size_t begin = file.find(std::string("\0\1\0\0\3\0\0\0\5\0\0\0\4\0\0\0map", 19));
  REQUIRE(begin != std::string::npos);
  CHECK((file.find("rgba", begin) != std::string::npos) == has_color);
  const std::uint32_t stride = has_color ? 16 : 12;
  std::string sizes;  // of a point, of a row, of all
  for (const std::uint32_t size : {stride, 2 * stride, 2 * stride}) {
    sizes.append(reinterpret_cast<const char*>(&size), sizeof size);
  }
  const std::size_t data = file.find(sizes, begin) + sizes.size();
  CHECK(number_at<float>(file, data) == 1.0F);
  CHECK(number_at<float>(file, data + stride + 4) == 5.5F);
  if (has_color) CHECK(number_at<std::uint32_t>(file, data + 28) == 0x280A141E);
}

TEST_CASE("a scene names Foxglove's schemas, each once") {
  const Pose pose;
  const std::pair<Eigen::Vector3d, Eigen::Vector3d> line(Eigen::Vector3d::Zero(),
                                                         Eigen::Vector3d::Ones());
  const std::string file = scene_of([&](FoxgloveWriter& writer) {
    writer.write_pose("/a/pose", "map", 1, pose);
    writer.write_pose("/b/pose", "map", 2, pose);
    writer.write_poses("/a/trajectory", "map", 1, {&pose, 1});
    writer.write_transform("map", "a", 1, pose);
    writer.write_lines("/loops", "map", 1, "loops", {&line, 1}, {255, 0, 0});
  });
  for (const char* name : {"foxglove.PoseInFrame", "foxglove.PosesInFrame",
                           "foxglove.FrameTransform", "foxglove.SceneUpdate"}) {
    const auto schema = object_with(file, std::string(R"({"title":")") + name + '"');
    CHECK(schema["properties"].is_object());
  }
  const auto scene = object_with(file, R"({"deletions":[],"entities":)");
  CHECK(scene["entities"][0]["lines"][0]["points"][1]["z"] == 1.0);
  CHECK(scene["entities"][0]["lines"][0]["type"] == 2);
  const auto transform = object_with(file, R"({"timestamp":{"sec":0,"nsec":1},"parent_frame_id")");
  CHECK(transform["child_frame_id"] == "a");
  CHECK(transform["rotation"]["w"] == 1.0);
}
