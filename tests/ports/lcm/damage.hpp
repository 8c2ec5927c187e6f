// Damage to encoded messages, by accident and by a forger.
#pragma once

#include <catch2/catch.hpp>
#include <cstdint>
#include <vector>

#include "unimapper/wire/byte_io.hpp"
#include "unimapper/wire/checksum.hpp"

namespace unimapper::lcm_port::lcm_test {

/// Every truncation, every flipped bit and every appended byte of `bytes` is refused.
template <typename Decode>
void check_only_the_original_passes(const std::vector<std::uint8_t>& bytes, const Decode& decode) {
  CHECK(decode(bytes).has_value());
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    if (decode(wire::Bytes(bytes).first(length))) FAIL("cut to " << length);
  }
  std::vector<std::uint8_t> damaged = bytes;
  for (std::size_t bit = 0; bit < bytes.size() * 8; ++bit) {
    const auto flip = static_cast<std::uint8_t>(1U << (bit % 8));
    damaged[bit / 8] ^= flip;
    if (decode(damaged)) FAIL("bit " << bit);
    damaged[bit / 8] ^= flip;
  }
  damaged.push_back(0);
  CHECK_FALSE(decode(damaged).has_value());
}

/// The bytes with a checksum that fits them again: what a forger would send.
inline std::vector<std::uint8_t> sealed(std::vector<std::uint8_t> bytes) {
  bytes.resize(bytes.size() - 4);
  wire::BigEndianWriter(bytes).put(wire::crc32(bytes));
  return bytes;
}

}  // namespace unimapper::lcm_port::lcm_test
