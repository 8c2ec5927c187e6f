#include "ports/keys/private_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "ports/keys/key.hpp"

namespace unimapper::keys {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kLargestFile = 4096;

[[noreturn]] void fail(const fs::path& path, const std::string& reason) {
  throw KeyError(path.string() + ": " + reason);
}

[[noreturn]] void fail_because(const fs::path& path, const std::string& what) {
  fail(path, what + ": " + std::strerror(errno));
}

/// Closes a descriptor.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() {
    if (number_ >= 0) close(number_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int get() const { return number_; }

 private:
  int number_;
};

void check_owner(const fs::path& path, const struct stat& found, mode_t forbidden,
                 const std::string& remedy) {
  if (found.st_uid != geteuid())
    fail(path, "belongs to another user; keys must be this user's own");
  if ((found.st_mode & forbidden) == 0) return;
  std::array<char, 8> mode;
  std::snprintf(mode.data(), mode.size(), "%04o", static_cast<unsigned>(found.st_mode & 07777U));
  fail(path, "has permissions " + std::string(mode.data()) + ": others could " + remedy);
}

bool write_all(int file, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = write(file, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return fsync(file) == 0;
}

}  // namespace

std::string read_private(const fs::path& file) {
  // No link and no pipe: what is checked is what is read.
  const Descriptor open_file(open(file.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK));
  if (open_file.get() < 0) {
    if (errno == ELOOP) fail(file, "is a symbolic link, not a key file");
    fail_because(file, "cannot be read");
  }
  struct stat found = {};
  if (fstat(open_file.get(), &found) != 0) fail_because(file, "cannot be read");
  if (!S_ISREG(found.st_mode)) fail(file, "is no key file");
  check_owner(file, found, 077, "read it; chmod 600 " + file.string());
  std::string text(kLargestFile + 1, '\0');
  std::size_t size = 0;
  for (;;) {
    const ssize_t got = read(open_file.get(), text.data() + size, text.size() - size);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail_because(file, "cannot be read");
    size += static_cast<std::size_t>(got);
    if (got == 0 || size == text.size()) break;
  }
  if (size > kLargestFile) fail(file, "is no key file: too large");
  text.resize(size);
  return text;
}

void write_private(const fs::path& file, std::string_view text, Existing existing) {
  const fs::path temporary = file.string() + ".new" + std::to_string(getpid());
  {
    const Descriptor open_file(
        open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600));
    if (open_file.get() < 0) fail_because(temporary, "cannot be written");
    if (!write_all(open_file.get(), text)) {
      const int reason = errno;
      unlink(temporary.c_str());
      errno = reason;
      fail_because(temporary, "cannot be written");
    }
  }
  // A link refuses where a file is; a rename replaces it.
  const bool placed = existing == Existing::kReplace ? rename(temporary.c_str(), file.c_str()) == 0
                                                     : link(temporary.c_str(), file.c_str()) == 0;
  const int reason = errno;
  if (existing == Existing::kRefuse || !placed) unlink(temporary.c_str());
  if (placed) return;
  errno = reason;
  if (reason == EEXIST) fail(file, "is there already; a key is not overwritten");
  fail_because(file, "cannot be written");
}

void check_private_folder(const fs::path& folder) {
  struct stat found = {};
  if (stat(folder.c_str(), &found) != 0) fail_because(folder, "cannot be read");
  if (!S_ISDIR(found.st_mode)) fail(folder, "is no folder of keys");
  check_owner(folder, found, 022, "add keys to it; chmod 700 " + folder.string());
}

void make_private_folder(const fs::path& folder) {
  if (mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST) {
    fail_because(folder, "cannot be made");
  }
  check_private_folder(folder);
}

}  // namespace unimapper::keys
