#include "ports/spool/files.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace unimapper::spool {

namespace fs = std::filesystem;

namespace {

constexpr mode_t kFileMode = 0644;

}  // namespace

bool Files::make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (!error && !fs::is_directory(folder, error) && !error) {
    error = std::make_error_code(std::errc::not_a_directory);
  }
  errno = error.value();
  return !error;
}

int Files::create(const fs::path& file) {
  return open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, kFileMode);
}

bool Files::write(int file, wire::Bytes bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(file, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      if (count == 0) errno = ENOSPC;
      return false;
    }
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return true;
}

bool Files::sync(int file) {
  if (fdatasync(file) != 0) return false;
  struct stat status = {};
  if (fstat(file, &status) != 0) return false;
  // A file without a name takes everything and keeps nothing.
  if (status.st_nlink == 0) errno = ENOENT;
  return status.st_nlink > 0;
}

bool Files::sync_folder(const fs::path& folder) {
  const int file = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (file < 0) return false;
  // Some file systems cannot sync a folder, and have nothing to sync there.
  const bool ok = fsync(file) == 0 || errno == EINVAL;
  const int error = errno;
  ::close(file);
  errno = error;
  return ok;
}

bool Files::truncate(int file, std::uint64_t bytes) {
  return ftruncate(file, static_cast<off_t>(bytes)) == 0;
}

bool Files::remove(const fs::path& file) { return unlink(file.c_str()) == 0 || errno == ENOENT; }

void Files::close(int file) { ::close(file); }

InputFile::InputFile(const fs::path& path) : file_(open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
  struct stat status = {};
  if (file_ < 0) return;
  if (fstat(file_, &status) == 0 && S_ISREG(status.st_mode)) {
    size_ = static_cast<std::uint64_t>(status.st_size);
    return;
  }
  ::close(file_);
  file_ = -1;
}

InputFile::~InputFile() {
  if (file_ >= 0) ::close(file_);
}

bool InputFile::read(std::uint64_t offset, std::size_t count,
                     std::vector<std::uint8_t>& bytes) const {
  bytes.clear();
  if (offset > size_ || count > size_ - offset) return false;
  bytes.resize(count);
  std::size_t done = 0;
  while (done < count) {
    const ssize_t part =
        pread(file_, bytes.data() + done, count - done, static_cast<off_t>(offset + done));
    if (part < 0 && errno == EINTR) continue;
    if (part <= 0) {
      bytes.clear();
      return false;
    }
    done += static_cast<std::size_t>(part);
  }
  return true;
}

bool FolderLock::acquire(const fs::path& file) {
  release();
  file_ = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, kFileMode);
  if (file_ < 0) return false;
  if (flock(file_, LOCK_EX | LOCK_NB) == 0) return true;
  const int error = errno;
  release();
  errno = error;
  return false;
}

void FolderLock::release() {
  if (file_ >= 0) ::close(file_);
  file_ = -1;
}

}  // namespace unimapper::spool
