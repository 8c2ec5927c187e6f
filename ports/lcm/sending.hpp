// Encoded keyframes as LCM messages of bounded size.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "unimapper/wire/pieces.hpp"

namespace unimapper::lcm_port {

using wire::EncodedKeyframe;

inline constexpr std::uint32_t kSmallestDatagramBytes = 256;
inline constexpr std::uint32_t kLargestDatagramBytes = 60000;
/// For links where one lost fragment is likely, such as Wi-Fi.
inline constexpr std::uint32_t kUnfragmentedDatagramBytes = 1300;

/// Bytes of a datagram that are not a piece's data: LCM's header, the channel, the piece's head.
inline constexpr std::uint32_t kDatagramOverheadBytes = 87;

/// The pieces of `keyframe` as messages for `kKeyframeChannel`, in order. No datagram exceeds
/// `datagram_bytes`. Throws std::invalid_argument if that lies outside the two limits above.
std::vector<std::vector<std::uint8_t>> cut_into_messages(const EncodedKeyframe& keyframe,
                                                         std::uint32_t datagram_bytes);

/// How many messages a keyframe of so many bytes makes. Throws like `cut_into_messages`.
std::uint32_t count_messages(std::size_t keyframe_bytes, std::uint32_t datagram_bytes);

/// How many of its first messages hold a keyframe's summary; see `wire::count_leading_pieces`.
/// Throws like `cut_into_messages`.
std::uint32_t count_leading_messages(wire::Bytes keyframe, std::uint32_t datagram_bytes);

}  // namespace unimapper::lcm_port
