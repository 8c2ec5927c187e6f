// Session identity as the bytes that a store names it by.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "unimapper/core/ids.hpp"

namespace unimapper::store {

/// The identity as bytes: robot (u32), then boot (u128), big-endian.
std::vector<std::uint8_t> to_key(const SessionId& id);

/// The identity of such bytes; nothing if they are none.
std::optional<SessionId> from_key(std::span<const std::uint8_t> key);

}  // namespace unimapper::store
