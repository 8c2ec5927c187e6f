// File read at any offset.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace unimapper::datasets::bag {

/// A file that is open for reading.
class ByteFile {
 public:
  /// Throws DatasetError naming the file.
  explicit ByteFile(std::filesystem::path path);
  ~ByteFile();
  ByteFile(const ByteFile&) = delete;
  ByteFile& operator=(const ByteFile&) = delete;

  /// As it was opened.
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Bytes of the file when it was opened.
  [[nodiscard]] std::uint64_t size() const { return size_; }

  /// `count` bytes from `offset` on, kept in `buffer`. Throws DatasetError naming the offset,
  /// and before any memory is taken if the file does not reach that far.
  std::string_view read(std::uint64_t offset, std::uint64_t count, std::string& buffer) const;

 private:
  std::filesystem::path path_;
  std::uint64_t size_ = 0;
  int descriptor_ = -1;
};

}  // namespace unimapper::datasets::bag
