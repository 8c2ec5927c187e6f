// New content of a folder or file, put in its position when it is whole.
#pragma once

#include <filesystem>

#include "src/apps/output_guard.hpp"

namespace unimapper::apps {

/// The right to write to a path, held by an open descriptor until destruction or the end of the
/// process.
class PathLock {
 public:
  PathLock() = default;
  explicit PathLock(int descriptor) : descriptor_(descriptor) {}
  PathLock(PathLock&& other) noexcept;
  PathLock& operator=(PathLock&& other) noexcept;
  ~PathLock();
  [[nodiscard]] int descriptor() const { return descriptor_; }

 private:
  int descriptor_ = -1;
};

/// What replaces a folder's content. It is written to a folder beside it (`.NAME.unimapper-new`)
/// and exchanged with it in one step, once everything is on the disk: whoever is killed, or finds
/// the disk full, before that step changes nothing. What the earlier content was made of is gone
/// with it; files of others stay.
///
/// Where one step is impossible, the files are renamed one by one, after all of them are whole:
/// in a folder that is a mount point or the working directory, whose parent cannot be written, or
/// in which others have folders of their own.
class FolderReplacement {
 public:
  /// Finds out whether `folder` can be written, before any work; it need not exist. Removes what a
  /// process that was killed has left. Throws std::runtime_error, also if another process writes to
  /// the folder.
  FolderReplacement(const std::filesystem::path& folder, Output output);
  /// Removes what was not published.
  ~FolderReplacement();
  FolderReplacement(const FolderReplacement&) = delete;
  FolderReplacement& operator=(const FolderReplacement&) = delete;

  /// Where to write.
  [[nodiscard]] const std::filesystem::path& path() const { return aside_; }
  /// Puts what was written in the folder's position, once. Throws std::runtime_error if the disk
  /// has not taken it; the folder is as before then.
  void publish();

 private:
  void exchange();
  void rename_each();

  Output output_;
  std::filesystem::path target_;
  std::filesystem::path aside_;
  bool in_one_step_ = true;
  PathLock lock_;
};

/// What replaces a single file. It is written to FILE.unimapper-new and renamed in one step, once
/// it is on the disk.
class FileReplacement {
 public:
  /// Finds out whether `file` can be written. Throws std::runtime_error.
  explicit FileReplacement(const std::filesystem::path& file);
  ~FileReplacement();
  FileReplacement(const FileReplacement&) = delete;
  FileReplacement& operator=(const FileReplacement&) = delete;

  /// Where to write.
  [[nodiscard]] const std::filesystem::path& path() const { return aside_; }
  /// Puts what was written in the file's position. Throws std::runtime_error.
  void publish();

 private:
  std::filesystem::path target_;
  std::filesystem::path aside_;
  PathLock lock_;
};

}  // namespace unimapper::apps
