// Small hand-made dataset files.
#pragma once

#include <catch2/catch.hpp>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>

#include "ports/datasets/dataset.hpp"
#include "tests/temporary_directory.hpp"

namespace unimapper::datasets {

/// Bytes from hexadecimal digits; blanks are for the reader.
inline std::string hex(std::string_view digits) {
  std::string bytes;
  int high = -1;
  for (const char c : digits) {
    if (c == ' ' || c == '\n') continue;
    const int value = c <= '9' ? c - '0' : c - 'a' + 10;
    if (high < 0) {
      high = value;
    } else {
      bytes += static_cast<char>(high * 16 + value);
      high = -1;
    }
  }
  return bytes;
}

inline std::string read_bytes(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// The message of the DatasetError that `call` throws; fails the test if it throws none.
template <typename Call>
std::string error_of(const Call& call) {
  try {
    call();
  } catch (const DatasetError& error) {
    return error.what();
  }
  FAIL("no DatasetError was thrown");
  return {};
}

/// x = 1, y = -2, z = 0.5, intensity = 0.25 as they lie in a KITTI scan.
inline const std::string kPointBytes = hex("0000803f 000000c0 0000003f 0000803e");

/// A pose one metre ahead, and the identity.
inline constexpr std::string_view kIdentityLine = "1 0 0 0 0 1 0 0 0 0 1 0\n";
inline constexpr std::string_view kOneMetreAheadLine = "1 0 0 1 0 1 0 0 0 0 1 0\n";

}  // namespace unimapper::datasets
