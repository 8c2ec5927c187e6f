// Keyframes of a pipeline in C written into shared memory.
#pragma once

#include <cstddef>
#include <span>

#include "unimapper/core/ids.hpp"

struct um_keyframe;

namespace unimapper::shared_memory {

/// As `write_keyframe`, byte by byte, of what `um_finished_get` gave.
[[nodiscard]] std::size_t write_c_keyframe(const um_keyframe& keyframe, const SessionId& session,
                                           std::span<std::byte> out) noexcept;

/// Stamp of its last scan; 0 without one.
[[nodiscard]] std::int64_t stamp_of(const um_keyframe& keyframe) noexcept;

}  // namespace unimapper::shared_memory
