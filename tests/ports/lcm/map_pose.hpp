// Places of a robot in a base's map, for tests.
#pragma once

#include "unimapper/wire/messages.hpp"

namespace unimapper::lcm_port::lcm_test {

/// A place by a keyframe of a map's epoch, all of its fields set.
inline wire::MapPoseMessage map_pose_of(const SessionId& session, std::int64_t epoch,
                                        std::uint32_t sequence) {
  wire::MapPoseMessage message;
  message.session = session;
  message.epoch = epoch;
  message.sequence = sequence;
  message.stamp_ns = 1700000000123456789;
  message.state = wire::MapPoseState::kLocalised;
  message.T_map_odometry = {Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5),
                            Eigen::Vector3d(100.25, -7.5, 0.125)};
  for (std::size_t i = 0; i < message.covariance.size(); ++i) {
    message.covariance[i] = 0.001 * static_cast<double>(i + 1);
  }
  message.loops = 4;
  message.since_loop_m = 12.5;
  return message;
}

}  // namespace unimapper::lcm_port::lcm_test
