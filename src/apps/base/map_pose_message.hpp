// Message of a robot's place in a map.
#pragma once

#include <cstdint>

#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/merge/localisation.hpp"
#include "unimapper/wire/messages.hpp"

namespace unimapper::apps {

/// What a robot is told of one of its keyframes, in the map of an epoch.
wire::MapPoseMessage map_pose_message(const merge::MapPose& at, std::int64_t epoch,
                                      const SessionId& session, std::uint32_t sequence,
                                      std::int64_t stamp_ns);

}  // namespace unimapper::apps
