// File that is written from front to back.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <string_view>

namespace unimapper::bags {

/// A recording cannot be written. The message names the file and why.
class BagError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// CRC-32 (IEEE 802.3) of `bytes`, going on from the checksum of what precedes them.
[[nodiscard]] std::uint32_t crc32(std::string_view bytes, std::uint32_t preceding = 0);

/// Writes a new file, knows how far it is, and sums up what it wrote. All throw BagError.
class OutputFile {
 public:
  explicit OutputFile(std::filesystem::path file);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(std::string_view bytes);
  /// Replaces bytes written before; the checksum stays that of what was written first.
  void overwrite(std::uint64_t offset, std::string_view bytes);
  /// Must be the last call: only closing tells whether everything reached the disk.
  void close();

  [[nodiscard]] std::uint64_t offset() const { return offset_; }
  /// Forgets the bytes summed up so far.
  void restart_checksum() { checksum_ = 0; }
  /// CRC-32 of all bytes since the start, or since it was restarted.
  [[nodiscard]] std::uint32_t checksum() const { return checksum_; }

 private:
  [[noreturn]] void refuse() const;

  std::filesystem::path path_;
  std::FILE* stream_;
  std::uint64_t offset_ = 0;
  std::uint32_t checksum_ = 0;
};

}  // namespace unimapper::bags
