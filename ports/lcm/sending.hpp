// An encoded keyframe on its way out, cut into pieces.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "ports/lcm/messages.hpp"

namespace unimapper {
struct KeyframeRecord;
}

namespace unimapper::wire {

/// An encoded keyframe and what its envelope needs.
struct EncodedKeyframe {
  SessionId session;
  std::uint32_t sequence = 0;
  std::int64_t stamp_ns = 0;  ///< of its last scan: when it was finished
  std::vector<std::uint8_t> bytes;
};

/// Encodes once for every path it is sent on. Throws as `encode_keyframe`.
EncodedKeyframe encode_for_sending(const KeyframeRecord& record);

inline constexpr std::uint32_t kSmallestDatagramBytes = 256;
inline constexpr std::uint32_t kLargestDatagramBytes = 60000;
/// For links where one lost fragment is likely, such as Wi-Fi.
inline constexpr std::uint32_t kUnfragmentedDatagramBytes = 1300;

/// Bytes of a datagram that are not a piece's data: LCM's header, the channel, the envelope.
inline constexpr std::uint32_t kDatagramOverheadBytes = 79;

/// The pieces of `keyframe` as messages for `kKeyframeChannel`, in order. No datagram exceeds
/// `datagram_bytes`. Throws std::invalid_argument if that lies outside the two limits above.
std::vector<std::vector<std::uint8_t>> cut_into_messages(const EncodedKeyframe& keyframe,
                                                         std::uint32_t datagram_bytes);

}  // namespace unimapper::wire
