#include "ports/delivery/c_map_pose.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>

namespace unimapper::delivery {

static_assert(sizeof(um_map_pose::reason) > wire::kMaxMapPoseReasonBytes);

um_map_pose to_c(const lcm_port::HeardMapPose& heard, const lcm_port::MapPoseCounters& counters) {
  const wire::MapPoseMessage& message = heard.message;
  const Eigen::Quaterniond q = message.T_map_odometry.quaternion();
  um_map_pose pose = {};
  pose.state = static_cast<std::uint32_t>(message.state);
  pose.epoch = message.epoch;
  pose.sequence = message.sequence;
  pose.loops = message.loops;
  pose.stamp_ns = message.stamp_ns;
  for (int i = 0; i < 3; ++i) pose.position[i] = message.T_map_odometry.translation[i];
  for (int i = 0; i < 4; ++i) pose.quaternion[i] = q.coeffs()[i];
  std::copy(message.covariance.begin(), message.covariance.end(), std::begin(pose.covariance));
  pose.since_loop_m = message.since_loop_m;
  pose.age_ns = std::chrono::nanoseconds(std::chrono::steady_clock::now() - heard.arrival).count();
  pose.refused = counters.outdated + counters.malformed;
  std::copy(message.reason.begin(), message.reason.end(), std::begin(pose.reason));
  return pose;
}

}  // namespace unimapper::delivery
