// Protection of datagrams between robot and base station.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "unimapper/core/ids.hpp"
#include "unimapper/wire/byte_io.hpp"

namespace unimapper::lcm_port {

/// Stands between a program's messages and the network: gives what is sent a code that a forger
/// cannot make, and lets in only what carries one. `ports/keys` holds those of robot and base. Used
/// by one thread at a time.
class DatagramGuard {
 public:
  DatagramGuard() = default;
  DatagramGuard(const DatagramGuard&) = delete;
  DatagramGuard& operator=(const DatagramGuard&) = delete;
  virtual ~DatagramGuard() = default;

  /// What is sent instead of `message`; nothing if it concerns a robot without a key. O(bytes).
  virtual std::optional<std::vector<std::uint8_t>> seal(std::string_view channel,
                                                        wire::Bytes message) = 0;
  /// The message in `datagram`, which it points into; nothing if it is refused, and counted.
  /// O(bytes).
  virtual std::optional<wire::Bytes> open(std::string_view channel, wire::Bytes datagram) = 0;
  /// Whether the encoded keyframe, whole now, is signed by the robot that it names. O(bytes).
  virtual bool accepts(const SessionId& session, wire::Bytes keyframe) = 0;
};

}  // namespace unimapper::lcm_port
