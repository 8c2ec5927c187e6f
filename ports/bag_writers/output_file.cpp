#include "ports/bag_writers/output_file.hpp"

#include <zlib.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <utility>

namespace unimapper::bags {

std::uint32_t crc32(std::string_view bytes, std::uint32_t preceding) {
  return static_cast<std::uint32_t>(
      ::crc32_z(preceding, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

OutputFile::OutputFile(std::filesystem::path file)
    : path_(std::move(file)), stream_(std::fopen(path_.c_str(), "wb")) {
  if (stream_ == nullptr) refuse();
}

OutputFile::~OutputFile() {
  if (stream_ != nullptr) std::fclose(stream_);
}

void OutputFile::write(std::string_view bytes) {
  if (bytes.empty()) return;
  if (std::fwrite(bytes.data(), 1, bytes.size(), stream_) != bytes.size()) refuse();
  offset_ += bytes.size();
  checksum_ = crc32(bytes, checksum_);
}

void OutputFile::overwrite(std::uint64_t offset, std::string_view bytes) {
  if (std::fseek(stream_, static_cast<long>(offset), SEEK_SET) != 0 ||
      std::fwrite(bytes.data(), 1, bytes.size(), stream_) != bytes.size() ||
      std::fseek(stream_, 0, SEEK_END) != 0) {
    refuse();
  }
}

void OutputFile::close() {
  std::FILE* stream = std::exchange(stream_, nullptr);
  if (std::fclose(stream) != 0) refuse();
}

void OutputFile::refuse() const {
  throw BagError(path_.string() + ": cannot write: " + std::strerror(errno));
}

}  // namespace unimapper::bags
