// Encoded keyframes cut into pieces that fit a transport's datagrams.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "unimapper/core/ids.hpp"
#include "unimapper/wire/byte_io.hpp"
#include "unimapper/wire/messages.hpp"

namespace unimapper::wire {

/// An encoded keyframe and what the heads of its pieces need.
struct EncodedKeyframe {
  SessionId session;                ///< the session it belongs to
  std::uint32_t sequence = 0;       ///< running number of the keyframe in its session
  std::int64_t stamp_ns = 0;        ///< of its last scan: when it was finished
  std::vector<std::uint8_t> bytes;  ///< the encoded keyframe
};

/// The pieces of `keyframe` in order, each of `piece_bytes` bytes but for the last. O(bytes).
/// Throws std::invalid_argument for pieces without a byte.
std::vector<ChunkMessage> cut_into_pieces(const EncodedKeyframe& keyframe,
                                          std::uint32_t piece_bytes);

/// How many of its first pieces of `piece_bytes` bytes hold a keyframe's summary; 0 if it has none,
/// or if pieces have more than 4,096 bytes. Of a keyframe without bytes nothing is known: as many
/// as with 128 keypoints. O(1).
std::uint32_t count_leading_pieces(Bytes keyframe, std::uint32_t piece_bytes);

}  // namespace unimapper::wire
