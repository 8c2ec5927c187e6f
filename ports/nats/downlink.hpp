// Reception of what sites have sent to the stream of the centre.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "ports/nats/server.hpp"
#include "unimapper/wire/keyframe_storage.hpp"
#include "unimapper/wire/receiver.hpp"

namespace unimapper::nats_port {

/// Where keyframes come from.
struct DownlinkOptions {
  Server server;                               ///< of the stream
  std::size_t max_keyframe_bytes = 4U << 20U;  ///< larger ones are dropped
  /// After so long without an answer the stream sends a message again.
  std::chrono::milliseconds redelivery{30'000};
  /// Told in words, from any thread.
  std::function<void(const std::string&)> report;
};

/// What became of messages since the start.
struct DownlinkCounters {
  std::uint64_t messages = 0;   ///< that came, repeated ones too
  std::uint64_t stored = 0;     ///< keyframes and sessions that were acknowledged, being stored
  std::uint64_t postponed = 0;  ///< times that the receiver refused one, which comes again
  std::uint64_t dropped = 0;    ///< forged, damaged or of another form: never sent again
  std::uint64_t failures = 0;   ///< connections that ended with a reason
};

/// Storage that hands everything on to another one and acknowledges to the stream what that one has
/// committed. A thread of its own fetches messages, ahead until it has
/// 8 MB, and then at most 16 messages more. All functions but those of the storage's own queries
/// are for the thread that feeds the receiver.
class Downlink : public wire::KeyframeStorage {
 public:
  /// Hands messages that have come to a receiver whose storage this is, as it would take them from
  /// a robot: a keyframe as one piece. Does not wait. Between two calls the receiver is advanced.
  virtual void take(wire::Receiver& receiver) = 0;
  /// Totals so far.
  [[nodiscard]] virtual DownlinkCounters counters() const = 0;
};

/// Starts it; needs no server yet. `storage` must outlive it. Throws NatsError for what `check`
/// refuses and in a build without NATS.
std::unique_ptr<Downlink> start_downlink(DownlinkOptions options, wire::KeyframeStorage& storage);

}  // namespace unimapper::nats_port
