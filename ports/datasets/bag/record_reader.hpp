// Bounded reader of little-endian records.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

#include "ports/datasets/dataset.hpp"

namespace unimapper::datasets::bag {

/// Takes values one after another from bytes that stay where they are. Throws DatasetError where
/// they end too early.
class RecordReader {
 public:
  explicit RecordReader(std::string_view bytes) : bytes_(bytes) {}

  /// Bytes not taken yet.
  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }
  /// Bytes taken so far.
  [[nodiscard]] std::size_t position() const { return at_; }

  /// The next `count` bytes.
  std::string_view take(std::uint64_t count) {
    if (count > left()) {
      throw DatasetError("ends " + std::to_string(count - left()) + " bytes too early");
    }
    const std::string_view taken = bytes_.substr(at_, static_cast<std::size_t>(count));
    at_ += static_cast<std::size_t>(count);
    return taken;
  }

  /// The next number, little endian.
  template <std::integral T>
  T number() {
    T value;
    std::memcpy(&value, take(sizeof value).data(), sizeof value);
    return value;
  }

  /// A four-byte length and as many bytes.
  std::string_view text() { return take(number<std::uint32_t>()); }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
};

}  // namespace unimapper::datasets::bag
