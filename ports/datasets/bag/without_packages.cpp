// Decompression and SQLite in a build without their packages.
#include "ports/datasets/bag/decompress.hpp"
#include "ports/datasets/bag/message_source.hpp"
#include "ports/datasets/files.hpp"

namespace unimapper::datasets::bag {

namespace {

constexpr const char* kWithoutLibarchive =
    "is compressed, and this build has no libarchive (UNIMAPPER_BUILD_BAGS)";

}  // namespace

std::string decompress(std::string_view packed, Compression compression, std::uint64_t bytes) {
  if (compression != Compression::kNone) throw DatasetError(kWithoutLibarchive);
  if (packed.size() != bytes) {
    throw DatasetError("has " + std::to_string(packed.size()) + " bytes but states " +
                       std::to_string(bytes));
  }
  return std::string(packed);
}

std::string decompress_prefix(std::string_view packed, Compression compression,
                              std::uint64_t limit) {
  if (compression != Compression::kNone) throw DatasetError(kWithoutLibarchive);
  return std::string(packed.substr(0, static_cast<std::size_t>(limit)));
}

void decompress_file(const std::filesystem::path& packed, Compression /*compression*/,
                     const std::filesystem::path& /*file*/) {
  fail(packed, kWithoutLibarchive);
}

std::unique_ptr<MessageSource> open_sqlite_bag(const std::filesystem::path& file) {
  fail(file, "is an SQLite database, and this build has no SQLite (UNIMAPPER_BUILD_BAGS)");
}

}  // namespace unimapper::datasets::bag
