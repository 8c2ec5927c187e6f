#include "ports/bag_writers/foxglove_schemas.hpp"

#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

namespace unimapper::bags {
namespace {

using Json = nlohmann::ordered_json;
using Members = std::initializer_list<std::pair<const char*, Json>>;

Json typed(const char* type) { return {{"type", type}}; }
Json number() { return typed("number"); }
Json text() { return typed("string"); }

Json object(const char* title, Members members) {
  Json result = {{"title", title}, {"type", "object"}, {"properties", Json::object()}};
  for (const auto& [name, schema] : members) result["properties"][name] = schema;
  return result;
}

Json array(Json items) { return {{"type", "array"}, {"items", std::move(items)}}; }

Json time() {
  return object("time", {{"sec", {{"type", "integer"}, {"minimum", 0}}},
                         {"nsec", {{"type", "integer"}, {"minimum", 0}, {"maximum", 999999999}}}});
}

Json duration() {
  return object("duration",
                {{"sec", typed("integer")},
                 {"nsec", {{"type", "integer"}, {"minimum", 0}, {"maximum", 999999999}}}});
}

Json vector(const char* title = "foxglove.Vector3") {
  return object(title, {{"x", number()}, {"y", number()}, {"z", number()}});
}

Json quaternion() {
  return object("foxglove.Quaternion",
                {{"x", number()}, {"y", number()}, {"z", number()}, {"w", number()}});
}

Json pose() {
  return object("foxglove.Pose", {{"position", vector()}, {"orientation", quaternion()}});
}

Json color() {
  return object("foxglove.Color",
                {{"r", number()}, {"g", number()}, {"b", number()}, {"a", number()}});
}

/// Alternatives of an enumeration, counted from `first`.
Json alternatives(const char* title, std::initializer_list<const char*> names) {
  Json options = Json::array();
  for (const char* name : names) {
    options.push_back({{"title", name}, {"const", options.size()}});
  }
  return {{"title", title}, {"oneOf", std::move(options)}};
}

Json line() {
  return object(
      "foxglove.LinePrimitive",
      {{"type", alternatives("foxglove.LineType", {"LINE_STRIP", "LINE_LOOP", "LINE_LIST"})},
       {"pose", pose()},
       {"thickness", number()},
       {"scale_invariant", typed("boolean")},
       {"points", array(vector("foxglove.Point3"))},
       {"color", color()},
       {"colors", array(color())},
       {"indices", array({{"type", "integer"}, {"minimum", 0}})}});
}

/// Of the primitives, lines alone are written; the others stay empty lists.
Json scene_update() {
  const Json deletion =
      object("foxglove.SceneEntityDeletion",
             {{"timestamp", time()},
              {"type", alternatives("foxglove.SceneEntityDeletionType", {"MATCHING_ID", "ALL"})},
              {"id", text()}});
  const Json key_value = object("foxglove.KeyValuePair", {{"key", text()}, {"value", text()}});
  const Json entity = object("foxglove.SceneEntity", {{"timestamp", time()},
                                                      {"frame_id", text()},
                                                      {"id", text()},
                                                      {"lifetime", duration()},
                                                      {"frame_locked", typed("boolean")},
                                                      {"metadata", array(key_value)},
                                                      {"arrows", array(typed("object"))},
                                                      {"cubes", array(typed("object"))},
                                                      {"spheres", array(typed("object"))},
                                                      {"cylinders", array(typed("object"))},
                                                      {"lines", array(line())},
                                                      {"triangles", array(typed("object"))},
                                                      {"texts", array(typed("object"))},
                                                      {"models", array(typed("object"))}});
  return object("foxglove.SceneUpdate",
                {{"deletions", array(deletion)}, {"entities", array(entity)}});
}

Json schema_of(FoxgloveSchema schema) {
  switch (schema) {
    case FoxgloveSchema::kPosesInFrame:
      return object("foxglove.PosesInFrame",
                    {{"timestamp", time()}, {"frame_id", text()}, {"poses", array(pose())}});
    case FoxgloveSchema::kPoseInFrame:
      return object("foxglove.PoseInFrame",
                    {{"timestamp", time()}, {"frame_id", text()}, {"pose", pose()}});
    case FoxgloveSchema::kFrameTransform:
      return object("foxglove.FrameTransform", {{"timestamp", time()},
                                                {"parent_frame_id", text()},
                                                {"child_frame_id", text()},
                                                {"translation", vector()},
                                                {"rotation", quaternion()}});
    case FoxgloveSchema::kSceneUpdate:
      break;
  }
  return scene_update();
}

}  // namespace

std::string schema_name(FoxgloveSchema schema) { return schema_of(schema)["title"]; }

std::string schema_text(FoxgloveSchema schema) { return schema_of(schema).dump(); }

}  // namespace unimapper::bags
