// Two sessions seen from above at one placement
#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include "unimapper/core/keyframe_record.hpp"

namespace unimapper::bench {

/// Writes a PNG: structure without ground of both sessions, the first one's blue and the second
/// one's orange, and their keyframes white. `T_map_keyframe`: levelled keyframe frame to a common
/// one, by session and keyframe. Throws std::runtime_error if the file cannot be written.
void write_pair_picture(const std::vector<SessionData>& sessions,
                        const std::array<std::vector<Pose>, 2>& T_map_keyframe,
                        const std::filesystem::path& file);

}  // namespace unimapper::bench
