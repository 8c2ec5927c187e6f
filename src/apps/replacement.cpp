#include "src/apps/replacement.hpp"

#include <fcntl.h>
#include <stdio.h>  // NOLINT: renameat2 is Linux's
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <set>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace unimapper::apps {

namespace fs = std::filesystem;

namespace {

constexpr const char* kSuffix = ".unimapper-new";

[[noreturn]] void fail(const fs::path& path, const std::string& what, int error) {
  throw std::runtime_error(path.string() + ": " + what + ": " + std::strerror(error));
}

/// The path with no link and no "." in it, also if it does not exist.
fs::path resolved(const fs::path& path) {
  const fs::path whole = fs::weakly_canonical(fs::absolute(path));
  return whole.has_filename() ? whole : whole.parent_path();
}

bool is_same_file(const fs::path& path, int descriptor) {
  struct stat of_path {};
  struct stat of_descriptor {};
  return stat(path.c_str(), &of_path) == 0 && fstat(descriptor, &of_descriptor) == 0 &&
         of_path.st_dev == of_descriptor.st_dev && of_path.st_ino == of_descriptor.st_ino;
}

bool is_own_device(const fs::path& folder) {
  struct stat of_folder {};
  struct stat of_parent {};
  return stat(folder.c_str(), &of_folder) == 0 &&
         stat(folder.parent_path().c_str(), &of_parent) == 0 &&
         of_folder.st_dev != of_parent.st_dev;
}

bool is_working_directory(const fs::path& folder) {
  std::error_code error;
  return fs::equivalent(folder, fs::current_path(error), error) && !error;
}

/// Whether others have folders in it: processes may be writing there, so these must stay what they
/// are.
bool holds_folders_of_others(const fs::path& folder, Output output) {
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const fs::path name = entry.path().filename();
    const bool is_folder = entry.is_directory() && !entry.is_symlink();
    if (is_folder && name != kSuffix && !is_output_folder(name, output)) return true;
  }
  return false;
}

/// Opens (and makes, with `make`) and locks what `path` names, and still names after that.
template <typename Make>
PathLock lock_path(const fs::path& path, const fs::path& wanted, const Make& make) {
  for (int attempt = 0; attempt < 100; ++attempt) {
    const int descriptor = make();
    if (descriptor < 0) fail(wanted, "cannot be written", errno);
    PathLock lock(descriptor);
    // A file system without locks has no second writer that we could tell.
    if (flock(descriptor, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
      throw std::runtime_error(wanted.string() + ": another process is writing there");
    }
    // Removed or renamed meanwhile by who had it.
    if (is_same_file(path, descriptor)) return lock;
  }
  throw std::runtime_error(wanted.string() + ": others keep writing there");
}

void clear(const fs::path& folder) {
  std::vector<fs::path> entries;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    entries.push_back(entry.path());
  }
  for (const fs::path& entry : entries) fs::remove_all(entry);
}

void sync_folder(const fs::path& folder) {
  const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  const PathLock closes(descriptor);
  // Some file systems know no fsync of folders; the rename has happened in any case.
  (void)fsync(descriptor);
}

/// Files below `folder`, relative to it.
std::vector<fs::path> files_below(const fs::path& folder) {
  std::vector<fs::path> files;
  for (fs::recursive_directory_iterator entry(folder), end; entry != end; ++entry) {
    if (entry->is_directory() && !entry->is_symlink()) {
      if (entry->path().filename() == kSuffix) entry.disable_recursion_pending();
      continue;
    }
    files.push_back(entry->path().lexically_relative(folder));
  }
  return files;
}

void sync_file(const fs::path& file) {
  const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
  if (descriptor < 0) return;  // a link of somebody's, or a file that was already there
  const PathLock closes(descriptor);
  if (fsync(descriptor) != 0) fail(file, "cannot be written to the disk", errno);
}

/// Waits until the disk has everything below `folder`, which is open: file by file, or with
/// thousands of labels all that the file system has.
void sync_tree(const fs::path& folder, int descriptor) {
  constexpr std::size_t kMostFiles = 500;
  const std::vector<fs::path> files = files_below(folder);
  if (files.size() > kMostFiles) {
    if (syncfs(descriptor) != 0) fail(folder, "cannot be written to the disk", errno);
    return;
  }
  std::set<fs::path> folders{folder};
  for (const fs::path& file : files) {
    sync_file(folder / file);
    folders.insert((folder / file).parent_path());
  }
  for (const fs::path& below : folders) sync_folder(below);
}

/// One file under a second name, or a copy where the file system has no second names.
void link_file(const fs::path& from, const fs::path& to) {
  fs::create_directories(to.parent_path());
  std::error_code error;
  fs::create_hard_link(from, to, error);
  if (error) fs::copy(from, to, fs::copy_options::copy_symlinks);
}

}  // namespace

PathLock::PathLock(PathLock&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}

PathLock& PathLock::operator=(PathLock&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  return *this;
}

PathLock::~PathLock() {
  if (descriptor_ >= 0) close(descriptor_);
}

FolderReplacement::FolderReplacement(const fs::path& folder, Output output)
    : output_(output), target_(resolved(folder)) {
  std::error_code error;
  fs::create_directories(target_.parent_path(), error);
  if (error) throw std::runtime_error(folder.string() + ": cannot be made: " + error.message());
  if (fs::exists(target_)) {
    if (!fs::is_directory(target_)) fail(folder, "cannot be a folder", ENOTDIR);
    if (access(target_.c_str(), R_OK | W_OK | X_OK) != 0) fail(folder, "cannot be written", errno);
    in_one_step_ = !is_own_device(target_) && !is_working_directory(target_) &&
                   access(target_.parent_path().c_str(), W_OK | X_OK) == 0 &&
                   !holds_folders_of_others(target_, output);
  }
  aside_ = in_one_step_ ? target_.parent_path() / ("." + target_.filename().string() + kSuffix)
                        : target_ / kSuffix;
  lock_ = lock_path(aside_, folder, [this] {
    if (mkdir(aside_.c_str(), 0777) != 0 && errno != EEXIST) return -1;
    return open(aside_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC | O_NOFOLLOW);
  });
  clear(aside_);
}

FolderReplacement::~FolderReplacement() {
  std::error_code ignored;
  if (lock_.descriptor() >= 0) fs::remove_all(aside_, ignored);
}

void FolderReplacement::publish() {
  sync_tree(aside_, lock_.descriptor());
  if (!in_one_step_ || (fs::exists(target_) && holds_folders_of_others(target_, output_))) {
    rename_each();
  } else {
    exchange();
  }
  lock_ = {};
}

void FolderReplacement::exchange() {
  // It fails where a folder with content is: one that appeared meanwhile is replaced like others.
  if (!fs::exists(target_) && rename(aside_.c_str(), target_.c_str()) == 0) {
    return sync_folder(target_.parent_path());
  }
  const bool is_earlier = holds_output(target_, output_);
  for (const fs::path& file : files_below(target_)) {
    if (is_earlier && is_output_file(file, output_)) continue;
    if (!fs::exists(fs::symlink_status(aside_ / file))) link_file(target_ / file, aside_ / file);
  }
  fs::permissions(aside_, fs::status(target_).permissions());
  // What has the name of the folder beside it after the exchange is locked as before it: nobody
  // writes there while it is removed. Who published it may be about to end.
  PathLock earlier(open(target_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (earlier.descriptor() >= 0) (void)flock(earlier.descriptor(), LOCK_EX);
  sync_folder(aside_);
  if (renameat2(AT_FDCWD, aside_.c_str(), AT_FDCWD, target_.c_str(), RENAME_EXCHANGE) != 0) {
    if (errno != EINVAL && errno != ENOSYS) fail(target_, "cannot be replaced", errno);
    return rename_each();
  }
  sync_folder(target_.parent_path());
  std::error_code ignored;
  fs::remove_all(aside_, ignored);
}

void FolderReplacement::rename_each() {
  fs::create_directories(target_);
  std::vector<fs::path> stale;
  if (holds_output(target_, output_)) {
    for (const fs::path& file : files_below(target_)) {
      if (is_output_file(file, output_) && !fs::exists(aside_ / file)) stale.push_back(file);
    }
  }
  const std::vector<fs::path> written = files_below(aside_);
  for (const fs::path& file : written) fs::create_directories((target_ / file).parent_path());
  for (const fs::path& file : written) fs::rename(aside_ / file, target_ / file);
  for (const fs::path& file : stale) fs::remove(target_ / file);
  std::set<fs::path> folders;
  for (const fs::path& file : written) folders.insert((target_ / file).parent_path());
  for (const fs::path& below : folders) sync_folder(below);
  fs::remove_all(aside_);
}

FileReplacement::FileReplacement(const fs::path& file) : target_(resolved(file)) {
  aside_ = target_;
  aside_ += kSuffix;
  std::error_code error;
  fs::create_directories(target_.parent_path(), error);
  if (error) throw std::runtime_error(file.string() + ": cannot be made: " + error.message());
  if (fs::is_directory(target_)) fail(file, "cannot be a file", EISDIR);
  if (fs::exists(target_) && access(target_.c_str(), W_OK) != 0) {
    fail(file, "cannot be written", errno);
  }
  lock_ = lock_path(aside_, file, [this] {
    return open(aside_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
  });
}

FileReplacement::~FileReplacement() {
  std::error_code ignored;
  if (lock_.descriptor() >= 0) fs::remove(aside_, ignored);
}

void FileReplacement::publish() {
  if (fsync(lock_.descriptor()) != 0) fail(target_, "cannot be written to the disk", errno);
  if (rename(aside_.c_str(), target_.c_str()) != 0) fail(target_, "cannot be replaced", errno);
  sync_folder(target_.parent_path());
  lock_ = {};
}

}  // namespace unimapper::apps
