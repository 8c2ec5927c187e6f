// Damage to encoded messages, by accident and by a forger.
#pragma once

#include "tests/test.hpp"
#include "unimapper/wire/byte_io.hpp"

namespace unimapper::lcm_port::lcm_test {

/// The bytes with one bit changed.
inline std::vector<std::uint8_t> with_flipped(std::vector<std::uint8_t> bytes, std::size_t bit) {
  bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ (1U << (bit % 8)));
  return bytes;
}

/// Every truncation, every flipped bit and every appended byte of `bytes` is refused.
template <typename Decode>
void check_only_the_original_passes(const std::vector<std::uint8_t>& bytes, const Decode& decode) {
  CHECK(decode(bytes).has_value());
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    if (decode(wire::Bytes(bytes).first(length))) FAIL("cut to " << length);
  }
  for (std::size_t bit = 0; bit < bytes.size() * 8; ++bit) {
    if (decode(with_flipped(bytes, bit))) FAIL("bit " << bit);
  }
  std::vector<std::uint8_t> longer = bytes;
  longer.push_back(0);
  CHECK_FALSE(decode(longer).has_value());
}

/// The bytes with a checksum that fits them again: what a forger would send.
inline std::vector<std::uint8_t> sealed(std::vector<std::uint8_t> bytes) {
  bytes.resize(bytes.size() - 4);
  wire::BigEndianWriter(bytes).put(wire::crc32(bytes));
  return bytes;
}

/// Content of a file.
inline std::vector<std::uint8_t> bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

}  // namespace unimapper::lcm_port::lcm_test
