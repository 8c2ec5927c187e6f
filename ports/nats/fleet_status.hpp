// Progress of sites and centre, as the server of their stream knows it.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "ports/nats/server.hpp"

namespace unimapper::nats_port {

/// One site.
struct SiteStatus {
  std::uint64_t keyframes = 0;           ///< in the stream, for the centre
  std::uint64_t sessions = 0;            ///< messages about sessions in the stream
  std::optional<std::int64_t> heard_ns;  ///< when it said what follows, Unix time; empty: never
  std::uint64_t waiting = 0;             ///< keyframes that it has and the stream had not
  std::uint64_t too_large = 0;           ///< keyframes larger than the server's max_payload
  std::uint64_t damaged = 0;             ///< keyframes that are damaged at the site
  std::uint64_t failures = 0;            ///< attempts of its uplink that failed since its start
};

/// The stream and who sends and takes.
struct FleetStatus {
  std::uint64_t messages = 0;              ///< in the stream
  std::uint64_t bytes = 0;                 ///< that its messages take
  std::optional<std::uint64_t> max_bytes;  ///< that the stream or its account may hold
  bool has_centre = false;                 ///< a centre has been there
  std::uint64_t pending = 0;               ///< messages that it was not sent yet
  std::uint64_t unanswered = 0;            ///< sent and not acknowledged
  std::uint64_t redelivered = 0;           ///< unanswered messages that were sent more than once
  /// By name: all that have ever said how they are, and those with messages in the stream.
  std::map<std::string, SiteStatus> sites;
};

/// Asks a server. Makes the streams if there are none. O(messages in the stream). Throws NatsError.
FleetStatus fleet_status(const Server& server);

}  // namespace unimapper::nats_port
