// A shared keyframe and a pipeline's health as text.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "ports/shared_memory/content_reader.hpp"

namespace unimapper::apps {

/// One line: number, position, cells, keypoints, loops, and how many keyframes were missed so far.
[[nodiscard]] std::string keyframe_line(const shared_memory::KeyframeMessage& keyframe,
                                        std::uint32_t missed);

/// Lines with pose, up, cells, loops and times of a keyframe.
[[nodiscard]] std::vector<std::string> keyframe_lines(
    const shared_memory::KeyframeMessage& keyframe, std::uint32_t missed);

/// Lines with counts since the pipeline's start.
[[nodiscard]] std::vector<std::string> health_lines(const shared_memory::SharedHealth& health);

/// The keyframe from above, `columns` x `rows` characters, `metres` wide, the sensor in the middle
/// looking right, its left at the top: `#` static, `*` dynamic, `.` ground.
[[nodiscard]] std::vector<std::string> view_from_above(
    const shared_memory::KeyframeMessage& keyframe, std::size_t columns, std::size_t rows,
    double metres);

}  // namespace unimapper::apps
