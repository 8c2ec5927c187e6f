// A merged map as the page shows it.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "src/apps/view/point_octree.hpp"
#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/merge/merger.hpp"

namespace unimapper::apps {

/// Sessions, trajectories, loops, pairs and changes: the part of `api/map` that a merge knows
/// (docs/api.md).
[[nodiscard]] nlohmann::ordered_json describe_merge(const std::vector<SessionData>& sessions,
                                                    const merge::MergeResult& result);

/// A layer of points by name: "static", "removed" or "changes".
using Layers = std::map<std::string, PointOctree>;

/// Of a whole merge: its map, what is dynamic by the labels of robots and base, and what changed.
/// Reads every keyframe once.
[[nodiscard]] Layers layers_of(const std::vector<SessionData>& sessions,
                               const merge::MergeResult& result, float voxel_m);

/// `layers` of `api/map`: cubes, points and bytes of every node.
[[nodiscard]] nlohmann::ordered_json describe_layers(const Layers& layers);

/// `gzipped` points of one keyframe in its own frame, about `most` of them; `refined`: of a whole
/// merge, null otherwise.
[[nodiscard]] std::string keyframe_block(const KeyframeRecord& keyframe,
                                         const merge::RefinedKeyframe* refined,
                                         std::uint8_t session, std::size_t most = SIZE_MAX);

/// x, y, z, qx, qy, qz, qw.
[[nodiscard]] nlohmann::ordered_json describe_pose(const Pose& pose);

/// Time of a keyframe's reference scan, seconds.
[[nodiscard]] double stamp_s(const KeyframeRecord& keyframe);

/// Number of a session in a point.
[[nodiscard]] constexpr std::uint8_t session_byte(std::size_t session) {
  return static_cast<std::uint8_t>(session < 255 ? session : 255);
}

}  // namespace unimapper::apps
