// Message authentication code of datagrams.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "ports/keys/key.hpp"
#include "unimapper/core/ids.hpp"
#include "unimapper/wire/byte_io.hpp"

namespace unimapper::keys {

/// The end of the link that a datagram comes from. Each has keys of its own, so that a datagram
/// sent back to its sender is none of the other end's.
enum class End : std::uint8_t { kRobot, kBase };

/// A message authentication code: keyed BLAKE2b, cut to 128 bits.
using Code = std::array<std::uint8_t, 16>;

/// Codes of the datagrams of one start of one end of a link.
class DatagramCoder {
 public:
  /// Derives the key of this start from the secret. O(1), some microseconds.
  DatagramCoder(const LinkSecret& secret, End end, const BootId& boot);

  /// The code of a datagram's bytes on a channel. O(bytes), a nanosecond a byte.
  [[nodiscard]] Code code(std::string_view channel, wire::Bytes datagram) const;
  /// Whether this is the code, in a time that does not depend on how much of it is right.
  [[nodiscard]] bool is_code(std::string_view channel, wire::Bytes datagram,
                             wire::Bytes code) const;

 private:
  Secret<32> key_;
};

}  // namespace unimapper::keys
