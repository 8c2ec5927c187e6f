#include "src/apps/map_pose_text.hpp"

#include <fmt/format.h>

#include "unimapper/merge/localisation.hpp"

namespace unimapper::apps {

const char* map_pose_state_name(wire::MapPoseState state) {
  return merge::state_name(static_cast<merge::LocalisationState>(state));
}

std::array<double, 7> pose_numbers(const Pose& pose) {
  const Eigen::Vector3d& t = pose.translation;
  const Eigen::Quaterniond q = pose.quaternion();
  return {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
}

std::string map_pose_text(const wire::MapPoseMessage& at) {
  if (at.state == wire::MapPoseState::kAmbiguous) return "ambiguous: " + at.reason;
  if (at.state == wire::MapPoseState::kNotYet) return "not yet localised: " + at.reason;
  return fmt::format("localised in the map of epoch {} by {} loops, within {:.2f} m", at.epoch,
                     at.loops, position_sigma_m(at));
}

}  // namespace unimapper::apps
