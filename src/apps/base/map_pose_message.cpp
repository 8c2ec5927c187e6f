#include "src/apps/base/map_pose_message.hpp"

#include "src/apps/upper_triangle.hpp"

namespace unimapper::apps {

namespace {

/// The message has the localiser's states by their numbers.
constexpr bool is_same_state(wire::MapPoseState a, merge::LocalisationState b) {
  return static_cast<int>(a) == static_cast<int>(b);
}
static_assert(is_same_state(wire::MapPoseState::kNotYet, merge::LocalisationState::kNotYet) &&
              is_same_state(wire::MapPoseState::kAmbiguous, merge::LocalisationState::kAmbiguous) &&
              is_same_state(wire::MapPoseState::kLocalised, merge::LocalisationState::kLocalised));

}  // namespace

wire::MapPoseMessage map_pose_message(const merge::MapPose& at, std::int64_t epoch,
                                      const SessionId& session, std::uint32_t sequence,
                                      std::int64_t stamp_ns) {
  wire::MapPoseMessage message;
  message.session = session;
  message.epoch = epoch;
  message.sequence = sequence;
  message.stamp_ns = stamp_ns;
  message.state = static_cast<wire::MapPoseState>(at.state);
  message.T_map_odometry = at.T_map_odometry;
  message.covariance = upper_triangle(at.covariance);
  message.loops = static_cast<std::uint32_t>(at.loops);
  message.since_loop_m = at.since_loop_m;
  message.reason = at.reason;
  return message;
}

}  // namespace unimapper::apps
