// Bytes that this process has written to disks.
#pragma once

#include <cstdint>
#include <optional>

namespace unimapper::store {

/// What the kernel counts in /proc/self/io as written to block devices, or about to be; nothing
/// where it doesn't count. A file system in memory counts as 0.
std::optional<std::uint64_t> bytes_written_to_disk();

}  // namespace unimapper::store
