#include "ports/shared_memory/segment.hpp"

#include <fcntl.h>
#include <linux/futex.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <ctime>

namespace unimapper::shared_memory {

namespace {

struct flock lock_of_first_byte(short type) noexcept {
  struct flock lock = {};
  lock.l_type = type;
  lock.l_whence = SEEK_SET;
  lock.l_start = 0;
  lock.l_len = 1;
  return lock;
}

}  // namespace

bool is_share_name(std::string_view name) noexcept {
  const auto is_letter = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-';
  };
  if (name.empty() || name.size() > 40 || name.front() == '.') return false;
  return std::all_of(name.begin(), name.end(), [&](char c) { return is_letter(c) || c == '.'; });
}

FileName file_name(std::string_view share, std::string_view topic, FilePart part,
                   std::uint32_t number) noexcept {
  FileName name;
  if (!is_share_name(share) || !is_share_name(topic)) return name;
  char ending[16] = "";
  if (part == FilePart::kWriterLock) std::snprintf(ending, sizeof ending, ".writer");
  if (part == FilePart::kConsumer) std::snprintf(ending, sizeof ending, ".%u", number);
  std::snprintf(name.text, sizeof name.text, "/unimapper.%.*s.%.*s%s",
                static_cast<int>(share.size()), share.data(), static_cast<int>(topic.size()),
                topic.data(), ending);
  return name;
}

File::~File() {
  if (descriptor_ >= 0) close(descriptor_);
}

bool File::has_name() const noexcept {
  struct stat status = {};
  return fstat(descriptor_, &status) == 0 && status.st_nlink > 0;
}

std::int64_t File::size() const noexcept {
  struct stat status = {};
  return fstat(descriptor_, &status) == 0 ? std::int64_t{status.st_size} : -1;
}

bool File::lock() const noexcept {
  struct flock lock = lock_of_first_byte(F_WRLCK);
  return fcntl(descriptor_, F_OFD_SETLK, &lock) == 0;
}

void File::unlock() const noexcept {
  struct flock lock = lock_of_first_byte(F_UNLCK);
  (void)fcntl(descriptor_, F_OFD_SETLK, &lock);
}

bool File::is_locked() const noexcept {
  struct flock lock = lock_of_first_byte(F_WRLCK);
  return fcntl(descriptor_, F_OFD_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
}

File open_file(const FileName& name, bool writable) noexcept {
  if (name.text[0] == '\0') return {};
  return File(shm_open(name.text, writable ? O_RDWR : O_RDONLY, 0));
}

Outcome make_file(const FileName& name, unsigned permissions, File& file) noexcept {
  file = File(shm_open(name.text, O_RDWR | O_CREAT, static_cast<mode_t>(permissions)));
  if (!file.is_open()) {
    return {false, errno,
            "the file in /dev/shm cannot be made: it belongs to another user, or there is no "
            "shared memory here"};
  }
  struct stat status = {};
  if (fstat(file.descriptor(), &status) != 0 || status.st_uid != geteuid() ||
      !S_ISREG(status.st_mode)) {
    return {false, EPERM, "the file in /dev/shm belongs to another user: choose another name"};
  }
  if (fchmod(file.descriptor(), static_cast<mode_t>(permissions)) != 0) {
    return {false, errno, "the permissions of the file in /dev/shm cannot be set"};
  }
  return {};
}

Outcome reserve(const File& file, std::uint64_t bytes) noexcept {
  // Larger than an off_t: a 32-bit computer has no memory for it either.
  const auto length = static_cast<off_t>(bytes);
  if (length < 0 || static_cast<std::uint64_t>(length) != bytes) {
    return {false, EFBIG, "the segment is larger than a file can be: fewer or smaller chunks"};
  }
  if (ftruncate(file.descriptor(), length) != 0) {
    return {false, errno, "the file in /dev/shm cannot be resized"};
  }
  // Without this the memory is found when it is first written, or not found (SIGBUS).
  const int error = posix_fallocate(file.descriptor(), 0, length);
  if (error == 0) return {};
  return {false, error,
          "there is not enough shared memory (df /dev/shm): fewer or smaller chunks, or a larger "
          "one (docker: --shm-size)"};
}

Mapping::~Mapping() {
  if (data_ != nullptr) munmap(data_, bytes_);
}

Outcome Mapping::open(const File& file, std::size_t bytes, bool writable) noexcept {
  const int protection = writable ? PROT_READ | PROT_WRITE : PROT_READ;
  void* const memory =
      mmap(nullptr, bytes, protection, MAP_SHARED | MAP_POPULATE, file.descriptor(), 0);
  if (memory == MAP_FAILED) {
    return {false, errno, "the segment cannot be mapped: there is no address space or memory left"};
  }
  Mapping mapped;
  mapped.data_ = static_cast<std::byte*>(memory);
  mapped.bytes_ = bytes;
  swap(mapped);
  return {};
}

void wait_on(const Word& word, std::uint32_t value, std::int64_t timeout_ns) noexcept {
  timespec timeout = {};
  timeout.tv_sec = static_cast<time_t>(timeout_ns / 1'000'000'000);
  timeout.tv_nsec = static_cast<long>(timeout_ns % 1'000'000'000);
  (void)syscall(SYS_futex, &word, FUTEX_WAIT, value, &timeout, nullptr, 0);
}

void wake(const Word& word, std::uint32_t count) noexcept {
  (void)syscall(SYS_futex, &word, FUTEX_WAKE, count, nullptr, nullptr, 0);
}

}  // namespace unimapper::shared_memory
