// Cyclic redundancy check of messages and keyframes.
#pragma once

#include <cstdint>

#include "unimapper/wire/byte_io.hpp"

namespace unimapper::wire {

/// CRC-32 as in zlib and Ethernet.
std::uint32_t crc32(Bytes bytes);

}  // namespace unimapper::wire
