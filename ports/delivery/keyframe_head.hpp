// Head of an encoded keyframe: what a sender must know of it.
#pragma once

#include <cstdint>
#include <optional>

#include "unimapper/core/ids.hpp"
#include "unimapper/wire/byte_io.hpp"

namespace unimapper::delivery {

/// Whose keyframe it is, and which one.
struct KeyframeHead {
  SessionId session;           ///< it was encoded for
  std::uint32_t sequence = 0;  ///< in the session
};

/// The head of a keyframe of the present schema; nothing if the bytes do not begin with one. Does
/// not look at what follows. O(1).
[[nodiscard]] std::optional<KeyframeHead> read_head(wire::Bytes keyframe);

}  // namespace unimapper::delivery
