// Bytes of files under test.
#pragma once

#include "tests/test.hpp"

namespace unimapper::bags {

inline std::string read_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// The number of a type that lies at an offset.
template <typename Number>
Number number_at(std::string_view bytes, std::size_t offset) {
  Number value{};
  if (offset + sizeof value <= bytes.size()) {
    std::memcpy(&value, bytes.data() + offset, sizeof value);
  }
  return value;
}

/// Reads numbers and texts one after the other.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : bytes_(bytes) {}
  template <typename Number>
  Number get() {
    const auto value = number_at<Number>(bytes_, at_);
    at_ += sizeof value;
    return value;
  }
  std::string_view take(std::size_t count) {
    const std::string_view taken = bytes_.substr(std::min(at_, bytes_.size()), count);
    at_ += count;
    return taken;
  }
  std::string_view text() { return take(get<std::uint32_t>()); }
  [[nodiscard]] bool at_end() const { return at_ >= bytes_.size(); }
  [[nodiscard]] std::size_t offset() const { return at_; }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
};

}  // namespace unimapper::bags
