// Envelope of authenticated messages.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "unimapper/core/ids.hpp"
#include "unimapper/wire/byte_io.hpp"

namespace unimapper::lcm_port {

using wire::Bytes;

/// Bytes of the code at the end of an envelope.
inline constexpr std::size_t kCodeBytes = 16;
/// Bytes of an envelope that are not the message's.
inline constexpr std::uint32_t kEnvelopeBytes = 60;

/// A message on its way, as `authenticated_t` carries it. Views point into the datagram.
struct Envelope {
  std::uint32_t robot = 0;   ///< whose key it is made with
  BootId boot;               ///< of the sender's start
  std::uint64_t number = 0;  ///< of the datagram
  Bytes message;             ///< what it carries
  Bytes signed_bytes;        ///< what the code is of, besides the channel
  Bytes code;                ///< `kCodeBytes`
};

/// Whether the bytes claim to be an envelope; they may still be none.
[[nodiscard]] bool is_envelope(Bytes datagram);
/// The envelope, its code unchecked, or nothing if the bytes are none. O(1).
[[nodiscard]] std::optional<Envelope> read_envelope(Bytes datagram);
/// The envelope's bytes without the code, to which it is appended.
[[nodiscard]] std::vector<std::uint8_t> write_envelope(const Envelope& envelope);
/// Number of the robot that a message of ours, in no envelope, names; nothing if it is too short.
[[nodiscard]] std::optional<std::uint32_t> robot_of(Bytes message);

}  // namespace unimapper::lcm_port
