// Levelling of keyframes by what other keyframes of their session know of up.
#pragma once

#include <cstddef>
#include <vector>

#include "unimapper/core/keyframe_record.hpp"

namespace unimapper::merge {

/// A robot that starts on a tilted mount knows up only after some keyframes; the frames of those
/// before have the odometry's z axis. Levels them, and those without in between, by what the other
/// keyframes of one session, in order, know of up in the odometry frame: turns frame, cells and
/// poses, describes the keyframe anew, and adds the odometry's drift to the covariance. Across a
/// jump of the odometry nothing is concluded. Returns how many were levelled; none where no
/// keyframe knows up. To be called on sessions before they are merged or searched in. Cost: one
/// description per keyframe that is levelled.
std::size_t level_keyframes(std::vector<KeyframeRecord>& keyframes);
/// Levels the keyframes of a session, whose cells may be read on demand: they come levelled from
/// then on. Returns how many were levelled.
std::size_t level_keyframes(SessionData& session);

/// Turns a keyframe into the frame of `T_odometry_level`, at the same position: cells and
/// keypoints. O(cells).
void turn_keyframe(KeyframeRecord& keyframe, const Pose& T_odometry_level);

}  // namespace unimapper::merge
