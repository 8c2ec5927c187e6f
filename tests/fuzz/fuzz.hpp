// Helpers of fuzz targets: requirements, refusals, files and seeds.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

namespace unimapper::fuzz {

/// What does not hold ends the fuzzer, as a finding.
inline void require(bool holds) {
  if (!holds) std::abort();
}

inline std::string_view text_of(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

/// The bytes as a file, which is the same one in every call.
inline const std::string& file_of(std::span<const std::uint8_t> bytes) {
  static const int file = memfd_create("input", 0);
  static const std::string path = "/proc/self/fd/" + std::to_string(file);
  require(ftruncate(file, 0) == 0);
  require(pwrite(file, bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(bytes.size()));
  return path;
}

template <typename Refusal, typename Call>
void allow_refusal(const Call& call) {
  try {
    call();
  } catch (const Refusal&) {
    // The one way to refuse; anything else ends the fuzzer.
  }
}

inline void write_seed(const std::filesystem::path& file, std::span<const std::uint8_t> bytes) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream stream(file, std::ios::binary);
  stream.write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
  if (!stream.flush()) throw std::runtime_error(file.string() + ": cannot be written");
}

/// main() of a program that writes seeds to a folder.
template <typename Write>
int write_seeds(int argc, char** argv, const Write& write) {
  try {
    if (argc != 2) throw std::runtime_error("usage: SEEDS FOLDER");
    write(std::filesystem::path(argv[1]));
    return 0;
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}

}  // namespace unimapper::fuzz
