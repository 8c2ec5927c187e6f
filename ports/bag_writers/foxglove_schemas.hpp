// JSON schemas of Foxglove's messages for scenes.
#pragma once

#include <string>

namespace unimapper::bags {

/// What a scene is made of besides clouds, by Foxglove's names (https://docs.foxglove.dev,
/// schemas).
enum class FoxgloveSchema : std::uint8_t {
  kPosesInFrame,    ///< foxglove.PosesInFrame
  kPoseInFrame,     ///< foxglove.PoseInFrame
  kFrameTransform,  ///< foxglove.FrameTransform
  kSceneUpdate,     ///< foxglove.SceneUpdate
};

/// E.g. "foxglove.PoseInFrame".
[[nodiscard]] std::string schema_name(FoxgloveSchema schema);
/// The members and their types as JSON Schema, without descriptions.
[[nodiscard]] std::string schema_text(FoxgloveSchema schema);

}  // namespace unimapper::bags
