// Sending of what a site's store holds to the stream of the centre.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "ports/nats/server.hpp"
#include "ports/store/store_file.hpp"

namespace unimapper::nats_port {

/// What is sent, and where.
struct UplinkOptions {
  Server server;                ///< of the stream
  std::filesystem::path store;  ///< folder of the store
  std::string site;             ///< name of the site, `is_site_name`
  bool sends_all = false;       ///< including what was sent before
  /// Told in words, from the uplink's thread.
  std::function<void(const std::string&)> report;
};

/// What became of keyframes since the start.
struct UplinkCounters {
  std::uint64_t keyframes = 0;  ///< acknowledged by the stream
  std::uint64_t sessions = 0;   ///< messages about sessions that it acknowledged
  std::uint64_t failures = 0;   ///< attempts that ended with a reason, and were repeated
  std::uint64_t too_large = 0;  ///< times that a keyframe was larger than the server's max_payload
  std::uint64_t waiting = 0;    ///< keyframes stored and not acknowledged, at most ten seconds ago
};

/// Sends from a thread of its own what the store has committed, in the order of commits, and marks
/// in the store what the stream has acknowledged. Whatever fails is told in words, once, and tried
/// again after pauses that grow to 30 s. Memory: about 10 MB.
class Uplink {
 public:
  Uplink() = default;
  virtual ~Uplink() = default;
  Uplink(const Uplink&) = delete;
  Uplink& operator=(const Uplink&) = delete;

  /// Sends what is left as long as that succeeds, five seconds at most, and ends the thread.
  virtual UplinkCounters finish() = 0;
  /// Totals so far, from any thread.
  [[nodiscard]] virtual UplinkCounters counters() const = 0;
};

/// Starts it; needs no server yet. `held`: the store's lock, which must outlive it. Destruction
/// ends the thread without sending what is left. Throws NatsError for what `check` refuses and in a
/// build without NATS, store::StoreError.
std::unique_ptr<Uplink> start_uplink(UplinkOptions options, const store::StoreLock& held);

}  // namespace unimapper::nats_port
