// Temporary file of a merge
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>

namespace unimapper::merge {

/// What a merge needs again later and does not keep in memory. The file has no name and is gone
/// with the process, however that ends. All throw std::runtime_error.
class ScratchFile {
 public:
  /// In `folder`, which must exist.
  explicit ScratchFile(const std::filesystem::path& folder);
  ~ScratchFile();
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;

  /// Where the bytes lie from then on. Throws where the disk is full.
  std::uint64_t append(const void* bytes, std::size_t size);
  /// Bytes that were appended. Thread safe.
  void read(std::uint64_t offset, void* bytes, std::size_t size) const;

 private:
  std::filesystem::path folder_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

}  // namespace unimapper::merge
