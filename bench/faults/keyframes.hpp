// Seeded keyframes of a wanted size, and the names by which sent and stored ones are compared.
#pragma once

#include <cstdint>
#include <string>

#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/wire/byte_io.hpp"
#include "unimapper/wire/pieces.hpp"

namespace unimapper::bench {

/// What a generated keyframe consists of.
struct KeyframeSize {
  std::uint32_t bytes = 80000;  ///< about so many, encoded; at least some 500
  std::uint32_t images = 0;     ///< free-space images beside them, at most 32
  std::uint32_t image_rows =
      1;                 ///< of 360 pixels each; their code is short, the memory they take not
  double shift_m = 0.0;  ///< of the whole keyframe, along y
};

/// A valid keyframe: cells scattered over a square and above it, ten scans, 32 keypoints. The same
/// for the same seed and sequence.
KeyframeRecord generate_record(const SessionId& session, std::uint32_t sequence, std::uint64_t seed,
                               const KeyframeSize& size);

/// The same as a robot sends it.
wire::EncodedKeyframe generate_keyframe(const SessionId& session, std::uint32_t sequence,
                                        std::uint64_t seed, const KeyframeSize& size);

/// "SEQUENCE BYTES CRC32" of an encoded keyframe. The bytes hold the session, so that keyframes of
/// two sessions have two names.
std::string name_of(std::uint32_t sequence, wire::Bytes bytes);

}  // namespace unimapper::bench
