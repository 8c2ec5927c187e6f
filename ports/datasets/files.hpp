// File and directory input with errors that name the file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "ports/datasets/dataset.hpp"

namespace unimapper::datasets {

/// Throws DatasetError "FILE: REASON".
[[noreturn]] void fail(const std::filesystem::path& file, const std::string& reason);
/// Throws DatasetError "FILE: offset N: REASON".
[[noreturn]] void fail_at_offset(const std::filesystem::path& file, std::uint64_t offset,
                                 const std::string& reason);
/// Throws DatasetError "FILE:LINE: REASON"; lines count from 1.
[[noreturn]] void fail_at_line(const std::filesystem::path& file, std::size_t line,
                               const std::string& reason);

/// The whole file, or its first `limit` bytes. Throws DatasetError.
std::string read_file(const std::filesystem::path& file, std::size_t limit = SIZE_MAX);

/// Fills `content` with the first bytes of the file; how many it has. Throws DatasetError.
std::size_t read_file(const std::filesystem::path& file, std::span<char> content);

/// Bytes of a regular file. Throws DatasetError.
std::uint64_t file_bytes(const std::filesystem::path& file);

/// Natural order of names: runs of digits compare as numbers, so that scan 2 comes before scan 10.
bool natural_less(std::string_view a, std::string_view b);

/// The files in `directory` whose name ends in `extension` (with its dot, any letter case),
/// in natural order of their names; hidden ones are left out. Throws DatasetError if the directory
/// is unreadable.
std::vector<std::filesystem::path> list_files(const std::filesystem::path& directory,
                                              std::string_view extension);

/// The directories in `directory` in natural order of their names. Throws DatasetError.
std::vector<std::filesystem::path> list_directories(const std::filesystem::path& directory);

/// True where `directory` is one and holds at least one such file. Throws DatasetError if it is
/// unreadable.
bool holds(const std::filesystem::path& directory, std::string_view extension);

/// The first of `names` that exists in `directory`, letter case ignored; empty if none does.
std::filesystem::path find_child(const std::filesystem::path& directory,
                                 std::initializer_list<std::string_view> names);

/// A folder of its own for temporary files. Open files outlive their names, so it may go early.
class TemporaryFolder {
 public:
  /// Makes it in `parent`. Throws DatasetError.
  explicit TemporaryFolder(
      const std::filesystem::path& parent = std::filesystem::temp_directory_path());
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  /// Where it is.
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// `text` in lower case (ASCII).
std::string lower_case(std::string_view text);

}  // namespace unimapper::datasets
