// Reading and writing of numbers in a fixed byte order; checksums of bytes.
#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace unimapper::wire {

/// A run of bytes in memory that the object does not own.
using Bytes = std::span<const std::uint8_t>;

/// CRC-32 as in zlib and Ethernet, of messages and keyframes; not in `wire_encoder`.
std::uint32_t crc32(Bytes bytes);

/// Appends numbers to a byte string, their highest byte first.
class BigEndianWriter {
 public:
  explicit BigEndianWriter(std::vector<std::uint8_t>& out) : out_(out) {}

  /// Appends an integer.
  template <std::integral T>
  void put(T value) {
    const auto bits = static_cast<std::make_unsigned_t<T>>(value);
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      out_.push_back(static_cast<std::uint8_t>(bits >> (8U * (sizeof(T) - 1 - i))));
    }
  }
  /// Appends the bits of a double.
  void put(double value) { put(std::bit_cast<std::uint64_t>(value)); }
  /// Appends the bits of a float.
  void put(float value) { put(std::bit_cast<std::uint32_t>(value)); }
  /// Appends bytes as they are.
  void put(Bytes bytes) { out_.insert(out_.end(), bytes.begin(), bytes.end()); }

 private:
  std::vector<std::uint8_t>& out_;
};

/// Takes numbers off the front of a byte string. Reading past its end yields zeros and makes
/// `ok()` false for good, so a sequence of reads needs one check.
template <std::endian kOrder>
class ByteReader {
 public:
  explicit ByteReader(Bytes bytes) : bytes_(bytes) {}

  /// The next integer.
  template <std::integral T>
  T get() {
    if (remaining() < sizeof(T)) {
      position_ = bytes_.size();
      ok_ = false;
      return T{};
    }
    std::make_unsigned_t<T> bits = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i) {
      const std::size_t byte = kOrder == std::endian::little ? i : sizeof(T) - 1 - i;
      bits = static_cast<std::make_unsigned_t<T>>(
          bits | (static_cast<std::make_unsigned_t<T>>(bytes_[position_ + i]) << (8U * byte)));
    }
    position_ += sizeof(T);
    return static_cast<T>(bits);
  }
  /// The next double.
  double get_double() { return std::bit_cast<double>(get<std::uint64_t>()); }
  /// The next float.
  float get_float() { return std::bit_cast<float>(get<std::uint32_t>()); }
  /// The next `count` bytes, or none if there are fewer.
  Bytes get_bytes(std::uint64_t count) {
    const std::size_t begin = position_;
    skip(count);
    return ok_ ? bytes_.subspan(begin, static_cast<std::size_t>(count)) : Bytes{};
  }

  /// Passes over `count` bytes.
  void skip(std::uint64_t count) {
    ok_ = ok_ && count <= remaining();
    position_ = ok_ ? position_ + static_cast<std::size_t>(count) : bytes_.size();
  }

  /// Whether everything asked for so far was there.
  [[nodiscard]] bool ok() const { return ok_; }
  /// Bytes read so far.
  [[nodiscard]] std::size_t position() const { return position_; }
  /// Bytes not read yet.
  [[nodiscard]] std::size_t remaining() const { return bytes_.size() - position_; }

 private:
  Bytes bytes_;
  std::size_t position_ = 0;
  bool ok_ = true;
};

using LittleEndianReader = ByteReader<std::endian::little>;
using BigEndianReader = ByteReader<std::endian::big>;

}  // namespace unimapper::wire
