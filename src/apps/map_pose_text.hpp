// Place of a robot in a base's map in words and numbers.
#pragma once

#include <array>
#include <string>

#include "unimapper/wire/messages.hpp"

namespace unimapper::apps {

/// As `merge::state_name`: "not yet", "ambiguous" or "localised".
[[nodiscard]] const char* map_pose_state_name(wire::MapPoseState state);

/// x y z qx qy qz qw, metres.
[[nodiscard]] std::array<double, 7> pose_numbers(const Pose& pose);

/// "localised in the map of epoch 3 by 4 loops, within 0.21 m", or "ambiguous: " or "not yet
/// localised: " and the reason.
[[nodiscard]] std::string map_pose_text(const wire::MapPoseMessage& at);

}  // namespace unimapper::apps
