// Keyframes as byte strings; docs/wire-format.md has the layout.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "ports/lcm/byte_io.hpp"
#include "unimapper/core/keyframe_record.hpp"

namespace unimapper::wire {

inline constexpr std::uint32_t kKeyframeMagic = 0x464B4D55;  ///< "UMKF" in the file
inline constexpr std::uint16_t kKeyframeSchema = 2;
/// Also read: keyframes without free-space images.
inline constexpr std::uint16_t kOldestKeyframeSchema = 1;

/// Most elements of a kind that a keyframe may hold.
inline constexpr std::uint32_t kMaxScans = 65535;
inline constexpr std::uint32_t kMaxKeypoints = 65535;
inline constexpr std::uint32_t kMaxPlanes = 65535;
inline constexpr std::uint32_t kMaxImages = 32;

/// Bytes of a keyframe. Whatever `quantise` would change is changed on the way, so
/// encode(record) == encode(quantised record), and decode(encode(record)) is the quantised
/// record. Throws std::invalid_argument if the record is no keyframe: no scans, scans out of
/// order, a reference scan that is not there, a pose that is not rigid, too many elements.
/// About 4 bytes per cell. Cost: O(n log n) in the cells.
std::vector<std::uint8_t> encode_keyframe(const KeyframeRecord& record);

/// A decoded keyframe, or why the bytes are none.
struct DecodedKeyframe {
  std::optional<KeyframeRecord> record;
  std::string error;  ///< reason and byte offset, if there is no record
};

/// Reads what `encode_keyframe` wrote, now or when the schema was an older one; anything else is
/// refused, so that encode(decode(bytes)) == bytes for the present schema. Checks every count
/// against the bytes that are there before it allocates: the record takes at most five times the
/// memory of the bytes.
DecodedKeyframe decode_keyframe(Bytes bytes);

}  // namespace unimapper::wire
