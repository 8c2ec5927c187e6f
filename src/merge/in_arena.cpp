// Components of the onboard libraries in large pages.
#include "in_arena.hpp"

#if defined(__linux__)
#include <sys/mman.h>
#endif

#include <new>

namespace unimapper::merge {
namespace {

constexpr std::size_t kLargePage = std::size_t{1} << 21U;

/// Alignment of a block, which its size is rounded up to.
std::size_t page_of(std::size_t bytes) {
  return bytes < kLargePage ? Arena::kAlignment : kLargePage;
}

std::size_t whole_pages(std::size_t bytes) {
  return (bytes + page_of(bytes) - 1) / page_of(bytes) * page_of(bytes);
}

}  // namespace

LargePageBlock::LargePageBlock(std::size_t bytes)
    : MemoryBlock(whole_pages(bytes), page_of(bytes)) {
  if (data() == nullptr) throw std::bad_alloc();
#if defined(__linux__)
  // Advice only: a system without large pages refuses, and everything works as before.
  if (bytes >= kLargePage) madvise(data(), size(), MADV_HUGEPAGE);
#endif
}

}  // namespace unimapper::merge
