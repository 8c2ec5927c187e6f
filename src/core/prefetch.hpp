// Prefetching of cache lines.
#pragma once

namespace unimapper {

/// Starts loading the cache line at `address`; nothing is read, so any address will do. All
/// prefetches go through these two functions (a test looks, and counts the instructions): GCC 12
/// takes a const member function that only prefetches for one without effect, and deletes the calls
/// that it has not inlined. An empty assembler statement counts as an effect, and costs nothing.
[[gnu::always_inline]] inline void prefetch_for_read(const void* address) noexcept {
  __builtin_prefetch(address, 0);
  asm volatile("");
}

/// Starts loading the cache line at `address`, which will be written; nothing is read, so any
/// address will do.
[[gnu::always_inline]] inline void prefetch_for_write(const void* address) noexcept {
  __builtin_prefetch(address, 1);
  asm volatile("");
}

}  // namespace unimapper
