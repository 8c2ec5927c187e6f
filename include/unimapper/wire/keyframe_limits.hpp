// Schema and limits of encoded keyframes.
#pragma once

#include <cstdint>

namespace unimapper::wire {

inline constexpr std::uint32_t kKeyframeMagic = 0x464B4D55;  ///< "UMKF" in the file
inline constexpr std::uint16_t kKeyframeSchema = 6;
/// Also read: 1, without free-space images, 2, without the covariance of up, 3, with cells and
/// images that are not range coded, 4, with a boot id of 64 bits, and 5, without a summary: all
/// scans and cells before the covariance of up.
inline constexpr std::uint16_t kOldestKeyframeSchema = 1;

/// Most elements of a kind that a keyframe may hold.
inline constexpr std::uint32_t kMaxScans = 65535;
inline constexpr std::uint32_t kMaxKeypoints = 65535;
inline constexpr std::uint32_t kMaxPlanes = 65535;
inline constexpr std::uint32_t kMaxImages = 32;
inline constexpr std::uint32_t kMaxCells = 1U << 22U;  ///< static ones, and as many dynamic ones

}  // namespace unimapper::wire
