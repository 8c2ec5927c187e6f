// File operations of a spool, apart so that tests can let them fail.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "unimapper/wire/byte_io.hpp"

namespace unimapper::spool {

/// What a spool does with its folder. Functions that may fail return false or -1 and leave the
/// reason in `errno`.
class Files {
 public:
  Files() = default;
  virtual ~Files() = default;
  Files(const Files&) = delete;
  Files& operator=(const Files&) = delete;

  /// Makes the folder with its parents; true if it was there.
  virtual bool make_folder(const std::filesystem::path& folder);
  /// Makes a file that was not there, to be written at its end; its descriptor, or -1.
  virtual int create(const std::filesystem::path& file);
  /// Appends all bytes, or fails after some of them.
  virtual bool write(int file, wire::Bytes bytes);
  /// What was written survives a loss of power. Fails where the file was removed meanwhile.
  virtual bool sync(int file);
  /// The names of a folder's files survive a loss of power.
  virtual bool sync_folder(const std::filesystem::path& folder);
  /// Cuts the file off behind so many bytes.
  virtual bool truncate(int file, std::uint64_t bytes);
  /// Removes a file.
  virtual bool remove(const std::filesystem::path& file);
  /// Closes a descriptor.
  virtual void close(int file);
};

/// An open file for reading, closed at the end.
class InputFile {
 public:
  /// Opens a regular file; see `ok`.
  explicit InputFile(const std::filesystem::path& path);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  /// Whether it could be opened.
  [[nodiscard]] bool ok() const { return file_ >= 0; }
  /// Its bytes when it was opened.
  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// Reads `count` bytes at `offset` into `bytes`; false, and no bytes, if they are not there.
  bool read(std::uint64_t offset, std::size_t count, std::vector<std::uint8_t>& bytes) const;

 private:
  int file_;
  std::uint64_t size_ = 0;
};

/// Exclusive right to a folder, given back by the kernel when the process ends, however it ends.
class FolderLock {
 public:
  FolderLock() = default;
  ~FolderLock() { release(); }
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

  /// Locks the file; false with `errno`, EWOULDBLOCK if another process has it.
  bool acquire(const std::filesystem::path& file);
  /// Gives it back.
  void release();

 private:
  int file_ = -1;
};

}  // namespace unimapper::spool
