// Delivery of a robot's keyframes: to its disk, and over LCM to a base.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "ports/lcm/datagram_guard.hpp"
#include "ports/lcm/earlier_sessions.hpp"
#include "ports/lcm/publisher.hpp"
#include "ports/lcm/shared_link.hpp"
#include "ports/spool/spool.hpp"

namespace unimapper::delivery {

/// Where keyframes go, and what that may take.
struct DeliveryOptions {
  std::string url;  ///< as `lcm_port::open_link`'s; empty: nothing is sent
  /// Rates are those of all sessions together. With a guard, `datagram_bytes` has its envelope in
  /// it.
  lcm_port::PublisherOptions publisher;
  /// Authenticates what is sent and what is answered; null: nothing is.
  std::shared_ptr<lcm_port::DatagramGuard> guard;
  std::filesystem::path spool;       ///< folder; empty: memory alone
  spool::SpoolOptions spool_limits;  ///< `segment_bytes` is lowered where `bytes` demands it
  /// Longest time that `finish` goes on with earlier sessions once the own one is over.
  std::chrono::milliseconds earlier_timeout{30000};
  /// Longest time that `finish` takes for all sessions together.
  std::chrono::milliseconds finish_timeout = std::chrono::milliseconds::max();
  /// Longest time that `finish` waits for the disk in the end.
  std::chrono::milliseconds disk_timeout{10000};
};

/// What became of the keyframes of this start, and of those that earlier ones left in the spool.
struct DeliveryCounters {
  bool published = false;             ///< there is a URL
  bool spooled = false;               ///< there is a spool
  lcm_port::PublisherCounters own;    ///< zeros without a URL
  lcm_port::EarlierCounters earlier;  ///< zeros where nothing was left
  spool::SpoolCounters disk;          ///< zeros without a spool
};

/// Spool and publisher of one session; either, both or none. What earlier starts left in the spool
/// is delivered beside it, at `lcm_port::kBackfillShare` of the rate, until all of it is.
class Delivery {
 public:
  /// Opens the spool and the network, and begins to send. Throws spool::SpoolError,
  /// lcm_port::LinkError, and std::invalid_argument for an impossible name, size or rate.
  Delivery(const SessionInfo& info, DeliveryOptions options);
  /// Opens the spool and begins to send over a network that is open, whatever the URL. Throws
  /// spool::SpoolError, and std::invalid_argument for an impossible name, size or rate.
  Delivery(const SessionInfo& info, DeliveryOptions options, lcm_port::Link network);

  /// Spools and sends a keyframe of the session. Copies it and takes locks, none of which is held
  /// over a system call of disk or network; waits only where `publisher.drop_when_full` is off. One
  /// thread at a time.
  void publish(wire::EncodedKeyframe keyframe);
  /// From now on this is sent every second; its session, `bytes_sent` and, with a spool, the
  /// container `wire::kSpoolContainer` are filled in here.
  void set_health(wire::HealthMessage health);
  /// Whether there is a network.
  [[nodiscard]] bool is_published() const { return publisher_ != nullptr; }
  /// Whose keyframes it takes.
  [[nodiscard]] const SessionInfo& info() const { return info_; }

  /// What became of the keyframes so far. Thread safe.
  [[nodiscard]] DeliveryCounters counters() const;
  /// As `Publisher::map_pose`; nothing without a network. Thread safe.
  [[nodiscard]] std::optional<lcm_port::HeardMapPose> map_pose() const;
  /// Waits for the base's acknowledgements, and for the disk; see the options. Blocks.
  DeliveryCounters finish();

 private:
  void begin(lcm_port::Link network);

  const SessionInfo info_;
  const DeliveryOptions options_;
  // In this order: what sends uses the spool.
  std::unique_ptr<spool::Spool> spool_;
  std::unique_ptr<lcm_port::Publisher> publisher_;
  std::unique_ptr<lcm_port::EarlierSessionsSender> earlier_;
};

}  // namespace unimapper::delivery
