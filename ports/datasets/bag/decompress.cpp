#include "ports/datasets/bag/decompress.hpp"

#include <archive.h>
#include <archive_entry.h>

#include <algorithm>
#include <fstream>
#include <memory>

#include "ports/datasets/files.hpp"

namespace unimapper::datasets::bag {

namespace {

struct ArchiveCloser {
  void operator()(archive* reader) const { archive_read_free(reader); }
};
using ArchiveReader = std::unique_ptr<archive, ArchiveCloser>;

[[noreturn]] void fail_unpacking(archive* reader) {
  const char* reason = archive_error_string(reader);
  throw DatasetError(std::string("cannot be decompressed: ") +
                     (reason != nullptr ? reason : "unknown error"));
}

int filter_code(Compression compression) {
  switch (compression) {
    case Compression::kLz4:
      return ARCHIVE_FILTER_LZ4;
    case Compression::kZstd:
      return ARCHIVE_FILTER_ZSTD;
    case Compression::kBzip2:
      return ARCHIVE_FILTER_BZIP2;
    case Compression::kNone:
      break;
  }
  return ARCHIVE_FILTER_NONE;
}

/// A stream of bytes behind exactly one filter: libarchive is not left to guess, so contents that
/// look compressed stay as they are.
ArchiveReader new_reader(Compression compression) {
  ArchiveReader reader(archive_read_new());
  if (!reader) throw DatasetError("no memory for decompression");
  if (archive_read_append_filter(reader.get(), filter_code(compression)) != ARCHIVE_OK ||
      archive_read_set_format(reader.get(), ARCHIVE_FORMAT_RAW) != ARCHIVE_OK) {
    fail_unpacking(reader.get());
  }
  return reader;
}

void start_reading(archive* reader) {
  archive_entry* entry = nullptr;
  const int outcome = archive_read_next_header(reader, &entry);
  if (outcome != ARCHIVE_OK && outcome != ARCHIVE_EOF) fail_unpacking(reader);
}

/// Reads up to `count` bytes; 0 at the end.
std::size_t read_some(archive* reader, char* bytes, std::size_t count) {
  const la_ssize_t got = archive_read_data(reader, bytes, count);
  if (got < 0) fail_unpacking(reader);
  return static_cast<std::size_t>(got);
}

}  // namespace

std::string decompress_prefix(std::string_view packed, Compression compression,
                              std::uint64_t limit) {
  if (compression == Compression::kNone) return std::string(packed.substr(0, limit));
  if (packed.empty()) return {};
  const ArchiveReader reader = new_reader(compression);
  if (archive_read_open_memory(reader.get(), packed.data(), packed.size()) != ARCHIVE_OK) {
    fail_unpacking(reader.get());
  }
  start_reading(reader.get());
  // Memory grows with what is there, not with what a damaged header promises.
  std::string bytes;
  std::size_t filled = 0;
  const auto most = static_cast<std::size_t>(limit);
  while (filled < most) {
    const std::size_t room = std::max<std::size_t>(2 * filled, std::size_t{1} << 16);
    bytes.resize(std::min(most, room));
    const std::size_t got = read_some(reader.get(), bytes.data() + filled, bytes.size() - filled);
    if (got == 0) break;
    filled += got;
  }
  bytes.resize(filled);
  return bytes;
}

std::string decompress(std::string_view packed, Compression compression, std::uint64_t bytes) {
  if (bytes > kMaxBlockBytes) {
    throw DatasetError("states a block of " + std::to_string(bytes) + " bytes; at most " +
                       std::to_string(kMaxBlockBytes) + " are read");
  }
  // One byte more shows a block that is longer than it states.
  std::string block = decompress_prefix(packed, compression, bytes + 1);
  if (block.size() != bytes) {
    throw DatasetError("decompresses to " + std::string(block.size() > bytes ? "more" : "fewer") +
                       " than the " + std::to_string(bytes) + " bytes it states");
  }
  return block;
}

void decompress_file(const std::filesystem::path& packed, Compression compression,
                     const std::filesystem::path& file) {
  try {
    const ArchiveReader reader = new_reader(compression);
    constexpr std::size_t kBlockBytes = std::size_t{1} << 20;
    if (archive_read_open_filename(reader.get(), packed.c_str(), kBlockBytes) != ARCHIVE_OK) {
      fail_unpacking(reader.get());
    }
    start_reading(reader.get());
    std::ofstream out(file, std::ios::binary);
    std::string bytes(kBlockBytes, '\0');
    while (const std::size_t got = read_some(reader.get(), bytes.data(), bytes.size())) {
      if (!out.write(bytes.data(), static_cast<std::streamsize>(got))) {
        throw DatasetError("cannot write its contents to " + file.string() +
                           ": decompress it where there is room and hand that in");
      }
    }
    if (!out.flush()) throw DatasetError("cannot write its contents to " + file.string());
  } catch (const DatasetError& error) {
    fail(packed, error.what());
  }
}

}  // namespace unimapper::datasets::bag
