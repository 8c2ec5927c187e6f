// Signature after an encoded keyframe.
#pragma once

#include <cstddef>
#include <cstdint>

#include "unimapper/wire/byte_io.hpp"

namespace unimapper::wire {

inline constexpr std::uint32_t kSignatureMagic = 0x47534D55;  ///< "UMSG" in the file, at the end
inline constexpr std::size_t kSignatureBytes = 64;            ///< without the magic number

/// An encoded keyframe and the signature that follows it. Both point into the bytes.
struct SignedKeyframe {
  Bytes keyframe;   ///< what `decode_keyframe` reads, and what is signed
  Bytes signature;  ///< `kSignatureBytes`; empty if there is none
};

/// Tells them apart. No keyframe since schema 3 ends with the magic number itself: its last four
/// bytes are a variance below 10. O(1).
[[nodiscard]] inline SignedKeyframe split_signature(Bytes bytes) {
  constexpr std::size_t kTrailerBytes = kSignatureBytes + 4;
  if (bytes.size() < kTrailerBytes) return {bytes, {}};
  const auto magic = LittleEndianReader(bytes.last(4)).get<std::uint32_t>();
  if (magic != kSignatureMagic) return {bytes, {}};
  const Bytes keyframe = bytes.first(bytes.size() - kTrailerBytes);
  return {keyframe, bytes.subspan(keyframe.size(), kSignatureBytes)};
}

}  // namespace unimapper::wire
