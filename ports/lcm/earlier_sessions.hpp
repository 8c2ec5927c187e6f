// Sender of the sessions that earlier starts left in the storage.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "ports/lcm/publisher.hpp"

namespace unimapper::lcm_port {

/// Of the rate of sending, what earlier sessions may take while the robot maps.
inline constexpr double kBackfillShare = 0.25;

/// What became of earlier sessions.
struct EarlierCounters {
  std::uint64_t sessions = 0;                ///< that were not wholly delivered at the start
  std::uint64_t sessions_delivered = 0;      ///< sessions delivered since, and their end confirmed
  std::uint64_t keyframes = 0;               ///< that waited at the start
  std::uint64_t keyframes_acknowledged = 0;  ///< waiting keyframes stored by a base since
  std::uint64_t keyframes_lost = 0;          ///< waiting keyframes damaged or removed on disk
};

/// Delivers the sessions in a storage that no base has confirmed, under their own identities, one
/// after the other, the newest first. Nothing but a message a second is sent unless a base answers.
/// A thread of its own.
class EarlierSessionsSender {
 public:
  /// `storage` outlives it. `options.bytes_per_second` is what it may take; `done`, which may be
  /// empty, is called from its thread when all sessions are delivered. Throws like `Publisher`.
  EarlierSessionsSender(wire::SenderStorage& storage, Link link, const PublisherOptions& options,
                        std::function<void()> done = {});
  /// Stops at once; what is not delivered stays in the storage.
  ~EarlierSessionsSender();
  EarlierSessionsSender(const EarlierSessionsSender&) = delete;
  EarlierSessionsSender& operator=(const EarlierSessionsSender&) = delete;

  /// Sends on until all is delivered, the time is over, or for a second no base has answered.
  EarlierCounters finish(std::chrono::milliseconds timeout);
  /// What became of them so far. Thread safe.
  [[nodiscard]] EarlierCounters counters() const;

 private:
  void run();
  bool deliver(const wire::EarlierSession& session);
  /// False if it is to stop.
  bool wait();

  wire::SenderStorage& storage_;
  const Link link_;
  const PublisherOptions options_;
  const std::function<void()> done_;
  std::vector<wire::EarlierSession> sessions_;

  mutable std::mutex mutex_;
  std::condition_variable wake_;
  EarlierCounters counters_;  ///< of sessions that are over
  EarlierCounters present_;   ///< of the one being sent
  bool base_answers_ = false;
  bool over_ = false;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace unimapper::lcm_port
