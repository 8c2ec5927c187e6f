// Folder of a test in memory.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <string>
#include <system_error>

#include "tests/temporary_directory.hpp"

namespace unimapper::store::store_test {

/// A folder where waiting for the disk costs nothing: a killed process loses no file's content.
class MemoryFolder {
 public:
  MemoryFolder() {
    if (access("/dev/shm", W_OK) != 0) return;
    path_ = "/dev/shm/unimapper-store-test-" + std::to_string(getpid());
    std::filesystem::remove_all(path_);
    std::filesystem::create_directory(path_);
  }
  ~MemoryFolder() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
  }
  MemoryFolder(const MemoryFolder&) = delete;
  MemoryFolder& operator=(const MemoryFolder&) = delete;

  [[nodiscard]] std::filesystem::path path() const {
    return path_.empty() ? fallback_.path() : path_;
  }

 private:
  TemporaryDirectory fallback_;
  std::filesystem::path path_;
};

}  // namespace unimapper::store::store_test
