// Serialisation of keyframes; docs/wire-format.md has the layout.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "unimapper/core/keyframe_record.hpp"
#include "unimapper/wire/byte_io.hpp"

namespace unimapper::wire {

/// Bytes of a keyframe, by the same writer as `KeyframeEncoder`. Whatever is not on the grid of the
/// wire is rounded on the way, so decode(encode(record)) is the quantised record, and encoding that
/// gives the same bytes. Throws std::invalid_argument if the record is no keyframe: no scans, scans
/// out of order, a reference scan that is not there, a pose that is not rigid, too many elements, a
/// free-space image whose code is none, or if it is only a summary. About a byte per cell. O(cells
/// + bytes of the images): no image is decoded.
std::vector<std::uint8_t> encode_keyframe(const KeyframeRecord& record);

/// A decoded keyframe, or why the bytes are none.
struct DecodedKeyframe {
  std::optional<KeyframeRecord> record;  ///< the keyframe; empty if the bytes are none
  std::string error;                     ///< reason and byte offset, if there is no record
};

/// Reads what `encode_keyframe` wrote; anything else is refused, so that encode(decode(bytes)) ==
/// bytes. A signature after the
/// keyframe (`split_signature`) is passed over, not checked. Checks every count
/// against the bytes that are there before it allocates: cells take at most 64 times, images at
/// most 100 times the memory of their bytes. Refuses a keyframe that announces cells and images of
/// more than `max_record_bytes` of memory. O(cells + bytes of the images).
DecodedKeyframe decode_keyframe(Bytes bytes, std::uint64_t max_record_bytes = UINT64_MAX);

/// Bytes at the front that tell how long a keyframe's summary is.
inline constexpr std::size_t kSummaryHeadBytes = 168;

/// How many of a keyframe's first bytes are its summary: pose, covariance of up, reference scan and
/// keypoints; 3,618 with 128 keypoints. Nothing if fewer than `kSummaryHeadBytes` are there, and
/// for what is no keyframe. O(1).
std::optional<std::size_t> summary_bytes(Bytes bytes);

/// Reads a keyframe's summary, whatever follows it: a record with `is_summary`, whose reference
/// scan is its only one and that has neither cells nor images. O(keypoints).
DecodedKeyframe decode_summary(Bytes bytes);

}  // namespace unimapper::wire
