// Schema and limits of encoded keyframes.
#pragma once

#include <cstdint>

namespace unimapper::wire {

inline constexpr std::uint32_t kKeyframeMagic = 0x464B4D55;  ///< "UMKF" in the file
inline constexpr std::uint16_t kKeyframeSchema = 6;          ///< written and read

/// Most elements of a kind that a keyframe may hold.
inline constexpr std::uint32_t kMaxScans = 65535;
inline constexpr std::uint32_t kMaxKeypoints = 65535;
inline constexpr std::uint32_t kMaxPlanes = 65535;
inline constexpr std::uint32_t kMaxImages = 32;
inline constexpr std::uint32_t kMaxCells = 1U << 22U;  ///< static ones, and as many dynamic ones

}  // namespace unimapper::wire
