// Delivery of a run's keyframes: to disk, and to a base.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "ports/delivery/delivery.hpp"
#include "ports/keys/guards.hpp"
#include "src/apps/onboard/onboard_options.hpp"

namespace unimapper::apps {

/// What became of the keyframes of a run, and of those that earlier starts left in the spool.
struct DeliveryCounters : delivery::DeliveryCounters {
  keys::GuardCounters answers;  ///< with a key: what became of the bases' answers
  std::optional<lcm_port::HeardMapPose> map_pose;  ///< the last that a base said of the place
};

/// Delivery as the command line asks for it, which says in words what it finds.
class Delivery {
 public:
  /// Throws std::exception with a sentence for the user.
  /// `key`: of the robot, null for none; what is published is then authenticated with it.
  Delivery(const OnboardOptions& options, const SessionInfo& info,
           const keys::RobotKey* key = nullptr);

  /// Spools and publishes a keyframe.
  void take(wire::EncodedKeyframe keyframe) { delivery_.publish(std::move(keyframe)); }
  /// Whether keyframes are published.
  [[nodiscard]] bool is_published() const { return delivery_.is_published(); }
  /// Where the base says that the robot is in its map, in words; empty unless that is another
  /// state, or another map, than at the call before.
  std::string map_pose_news();
  /// As `delivery::Delivery`'s.
  void set_health(wire::HealthMessage health) { delivery_.set_health(std::move(health)); }

  /// Waits for the base's acknowledgements, and for the disk.
  DeliveryCounters finish();

 private:
  std::shared_ptr<keys::RobotGuard> guard_;  ///< null without a key
  delivery::Delivery delivery_;
  /// Epoch and state that were told last.
  std::pair<std::int64_t, wire::MapPoseState> told_{0, wire::MapPoseState::kNotYet};
};

/// What became of a run's keyframes, in words for the user.
void print_delivery(const DeliveryCounters& counters, std::uint64_t keyframes,
                    const OnboardOptions& options);

}  // namespace unimapper::apps
