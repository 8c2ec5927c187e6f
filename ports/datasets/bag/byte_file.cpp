#include "ports/datasets/bag/byte_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "ports/datasets/files.hpp"

namespace unimapper::datasets::bag {

ByteFile::ByteFile(std::filesystem::path path)
    : path_(std::move(path)), size_(file_bytes(path_)), descriptor_(open(path_.c_str(), O_RDONLY)) {
  if (descriptor_ < 0) fail(path_, std::string("cannot open: ") + std::strerror(errno));
}

ByteFile::~ByteFile() { close(descriptor_); }

std::string_view ByteFile::read(std::uint64_t offset, std::uint64_t count,
                                std::string& buffer) const {
  if (offset > size_ || count > size_ - offset) {
    throw DatasetError("offset " + std::to_string(offset) + ": the file ends before the " +
                       std::to_string(count) + " bytes expected here");
  }
  buffer.resize(static_cast<std::size_t>(count));
  std::size_t done = 0;
  while (done < buffer.size()) {
    const ssize_t got = pread(descriptor_, buffer.data() + done, buffer.size() - done,
                              static_cast<off_t>(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) {
      throw DatasetError("offset " + std::to_string(offset + done) + ": " +
                         (got == 0 ? "the file has become shorter" : std::strerror(errno)));
    }
    done += static_cast<std::size_t>(got);
  }
  return buffer;
}

}  // namespace unimapper::datasets::bag
