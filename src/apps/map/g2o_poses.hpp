// Poses in a g2o file, as `unimapper map import` reads them.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "unimapper/core/pose.hpp"

namespace unimapper::apps {

/// Poses of the vertices 0 to `count` - 1, levelled keyframe frame to map frame. Reads lines
/// VERTEX_SE3:QUAT, EDGE_SE3:QUAT and FIX, as export writes them; of edges and fixed vertices only
/// that they are whole and of vertices in range. Lines that are blank or begin with # are left out.
/// Throws std::runtime_error with `file` and line: another tag, missing or surplus numbers, what is
/// no finite number, no rotation, a vertex out of range, twice or missing.
[[nodiscard]] std::vector<Pose> parse_g2o_poses(std::string_view text, const std::string& file,
                                                std::size_t count);

}  // namespace unimapper::apps
