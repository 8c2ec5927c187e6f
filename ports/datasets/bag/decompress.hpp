// Decompression of LZ4 frames, Zstandard and bzip2 with bounded output.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace unimapper::datasets::bag {

/// Compressions that bags use.
enum class Compression : std::uint8_t { kNone, kLz4, kZstd, kBzip2 };

/// Largest block of messages that is taken into memory: recorders write a few MiB.
inline constexpr std::uint64_t kMaxBlockBytes = std::uint64_t{256} << 20;

/// Decompresses a block that states to have `bytes` bytes. Never holds more than that. Throws
/// DatasetError (without naming a file) if the block is damaged, has fewer or more bytes, or
/// states more than `kMaxBlockBytes`; also in a build without libarchive.
std::string decompress(std::string_view packed, Compression compression, std::uint64_t bytes);

/// Decompresses at most `limit` bytes of a block that does not state its length.
std::string decompress_prefix(std::string_view packed, Compression compression,
                              std::uint64_t limit = kMaxBlockBytes);

/// Decompresses a whole file into a new one. Throws DatasetError naming the file, also where its
/// contents would fill the disk.
void decompress_file(const std::filesystem::path& packed, Compression compression,
                     const std::filesystem::path& file);

}  // namespace unimapper::datasets::bag
