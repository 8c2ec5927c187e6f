// Checksum over all of a stored result.
#pragma once

#include <cstdint>

#include "ports/store/project.hpp"

namespace unimapper::store {

/// CRC-32 of what the tables keep of a result: the same when it is read back, another one where
/// anything of it has changed on the disk.
[[nodiscard]] std::int64_t checksum_of(const MapResult& result);

}  // namespace unimapper::store
