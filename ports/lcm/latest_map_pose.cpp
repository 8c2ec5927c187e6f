#include "ports/lcm/latest_map_pose.hpp"

#include <tuple>

namespace unimapper::lcm_port {

namespace {

bool is_older(const wire::MapPoseMessage& a, const wire::MapPoseMessage& b) {
  return std::tie(a.epoch, a.sequence) < std::tie(b.epoch, b.sequence);
}

}  // namespace

void LatestMapPose::take(const ReceivedMapPose& received,
                         std::chrono::steady_clock::time_point arrival) {
  if (!received) {
    ++counters_.malformed;
  } else if (received->session != session_) {
    ++counters_.of_others;
  } else if (latest_ && is_older(*received, latest_->message)) {
    ++counters_.outdated;
  } else {
    ++counters_.taken;
    latest_ = HeardMapPose{*received, arrival};
  }
}

}  // namespace unimapper::lcm_port
