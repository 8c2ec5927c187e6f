// CRC-32, by zlib.
#include <zlib.h>

#include "unimapper/wire/byte_io.hpp"

namespace unimapper::wire {

std::uint32_t crc32(Bytes bytes) {
  return static_cast<std::uint32_t>(::crc32_z(0, bytes.data(), bytes.size()));
}

}  // namespace unimapper::wire
