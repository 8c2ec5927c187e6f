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

std::string bytes_of_base64(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  std::uint32_t group = 0;
  for (std::size_t i = 0; i < text.size() && text[i] != '='; ++i) {
    group = group << 6U | static_cast<std::uint32_t>(digits.find(text[i]));
    if (i % 4 != 0) bytes += static_cast<char>(group >> (6 - 2 * (i % 4)) & 0xFFU);
  }
  return bytes;
}

}  // namespace

TEST_CASE("a cloud of a scene has positions and colours in base64") {
  const std::vector<Eigen::Vector3f> points = {{1.0F, 2.0F, 3.0F}, {-4.0F, 5.5F, 0.0F}};
  const std::vector<Rgba> colors = {{10, 20, 30, 40}, {50, 60, 70, 80}};
  const std::string file = scene_of([&](FoxgloveWriter& writer) {
    writer.write_cloud("/static", "map", 3'000'000'005, points, colors);
  });
  const auto cloud = object_with(file, R"({"timestamp":{"sec":3,)");
  CHECK(cloud["timestamp"]["nsec"] == 5);
  CHECK(cloud["frame_id"] == "map");
  CHECK(cloud["point_stride"] == 16);
  CHECK(cloud["fields"][3] == nlohmann::json({{"name", "red"}, {"offset", 12}, {"type", 1}}));
  const std::string data = bytes_of_base64(cloud["data"]);
  REQUIRE(data.size() == 32);
  CHECK(number_at<float>(data, 0) == 1.0F);
  CHECK(number_at<float>(data, 20) == 5.5F);
  CHECK(number_at<std::uint8_t>(data, 15) == 40);
  CHECK(number_at<std::uint8_t>(data, 28) == 50);
}

TEST_CASE("a cloud of one colour repeats it") {
  const std::vector<Eigen::Vector3f> points(3, Eigen::Vector3f::Zero());
  const Rgba color{1, 2, 3};
  const std::string file = scene_of([&](FoxgloveWriter& writer) {
    writer.write_cloud("/static", "map", 0, points, {&color, 1});
  });
  const auto cloud = object_with(file, R"({"timestamp":{"sec":0,)");
  const std::string data = bytes_of_base64(cloud["data"]);
  REQUIRE(data.size() == 48);
  CHECK(number_at<std::uint8_t>(data, 44) == 1);
  CHECK(number_at<std::uint8_t>(data, 47) == 255);
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
