// Schema and limits of encoded keyframes.
#pragma once

#include <cstddef>
#include <cstdint>

#include "unimapper/core/image_projection.hpp"

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

/// Why no keyframe has so many images of this shape and full-weight range, or null.
const char* image_head_fault(std::size_t images, const RangeImageShape& shape,
                             float full_weight_range_m) noexcept;

}  // namespace unimapper::wire
