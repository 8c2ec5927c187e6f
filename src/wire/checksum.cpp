#include "unimapper/wire/checksum.hpp"

#include <zlib.h>

namespace unimapper::wire {

std::uint32_t crc32(Bytes bytes) {
  return static_cast<std::uint32_t>(::crc32_z(0, bytes.data(), bytes.size()));
}

}  // namespace unimapper::wire
