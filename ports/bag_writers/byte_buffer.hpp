// Little-endian byte buffer.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace unimapper::bags {

static_assert(std::endian::native == std::endian::little, "numbers are written as memory lies");

/// Bytes that grow at their end. Numbers lie as the containers want them, unaligned.
class ByteBuffer {
 public:
  /// Appends one number.
  template <typename Number>
  void put(Number value) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    bytes_.append(bytes, sizeof value);
  }
  /// Appends bytes without their length.
  void put_bytes(std::string_view bytes) { bytes_.append(bytes); }
  /// Appends the length as 32 bits and the bytes.
  void put_text(std::string_view text) {
    put(static_cast<std::uint32_t>(text.size()));
    put_bytes(text);
  }
  /// Makes everything from here on content whose length in bytes, as a `Length`, stands before it:
  /// returns what `end_length` takes.
  template <typename Length>
  [[nodiscard]] std::size_t begin_length() {
    put(Length{0});
    return bytes_.size();
  }
  /// Sets the length that `begin_length` made room for.
  template <typename Length>
  void end_length(std::size_t begin) {
    const auto length = static_cast<Length>(bytes_.size() - begin);
    std::memcpy(bytes_.data() + begin - sizeof length, &length, sizeof length);
  }

  [[nodiscard]] std::string_view view() const { return bytes_; }
  [[nodiscard]] std::size_t size() const { return bytes_.size(); }
  [[nodiscard]] bool empty() const { return bytes_.empty(); }
  void clear() { bytes_.clear(); }

 private:
  std::string bytes_;
};

}  // namespace unimapper::bags
