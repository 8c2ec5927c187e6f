// Delivery of a run's keyframes: to disk, and to a base.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "ports/keys/guards.hpp"
#include "ports/lcm/earlier_sessions.hpp"
#include "ports/lcm/publisher.hpp"
#include "ports/lcm/shared_link.hpp"
#include "ports/spool/spool.hpp"
#include "src/apps/onboard/options.hpp"

namespace unimapper::apps {

/// What became of the keyframes of a run, and of those that earlier starts left in the spool.
struct DeliveryCounters {
  bool published = false;
  bool spooled = false;
  lcm_port::PublisherCounters own;
  lcm_port::EarlierCounters earlier;
  spool::SpoolCounters disk;
  keys::GuardCounters answers;  ///< with a key: what became of the bases' answers
};

/// Spool and publisher as the command line asks for them; either, both or none.
class Delivery {
 public:
  /// Throws std::exception with a sentence for the user.
  /// `key`: of the robot, null for none; what is published is then authenticated with it.
  Delivery(const OnboardOptions& options, const SessionInfo& info,
           const keys::RobotKey* key = nullptr);

  /// Spools and publishes a keyframe.
  void take(wire::EncodedKeyframe keyframe);
  /// Null if nothing is published.
  [[nodiscard]] lcm_port::Publisher* publisher() { return publisher_.get(); }

  /// Waits for the base's acknowledgements, and for the disk.
  DeliveryCounters finish();

 private:
  const OnboardOptions& options_;
  const SessionInfo info_;
  std::shared_ptr<keys::RobotGuard> guard_;  ///< null without a key
  // In this order: what sends uses the spool.
  std::unique_ptr<spool::Spool> spool_;
  std::unique_ptr<lcm_port::Publisher> publisher_;
  std::unique_ptr<lcm_port::EarlierSessionsSender> earlier_;
};

/// What became of a run's keyframes, in words for the user.
void print_delivery(const DeliveryCounters& counters, std::uint64_t keyframes,
                    const OnboardOptions& options);

}  // namespace unimapper::apps
