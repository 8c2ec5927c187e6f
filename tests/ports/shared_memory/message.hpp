// Message whose bytes tell whether it is whole.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

namespace unimapper::shared_memory::test {

/// Fills `memory` with words that follow from `seed`.
inline void fill(std::span<std::byte> memory, std::uint64_t seed) {
  std::uint64_t word = seed * 0x9E3779B97F4A7C15ULL + 1;
  for (std::size_t at = 0; at + sizeof word <= memory.size(); at += sizeof word) {
    std::memcpy(memory.data() + at, &word, sizeof word);
    word = word * 6364136223846793005ULL + 1442695040888963407ULL;
  }
}

/// Whether these are the words of one `fill`.
inline bool is_whole(std::span<const std::byte> memory) {
  std::uint64_t expected = 0;
  for (std::size_t at = 0; at + sizeof expected <= memory.size(); at += sizeof expected) {
    std::uint64_t word = 0;
    std::memcpy(&word, memory.data() + at, sizeof word);
    if (at > 0 && word != expected) return false;
    expected = word * 6364136223846793005ULL + 1442695040888963407ULL;
  }
  return true;
}

}  // namespace unimapper::shared_memory::test
