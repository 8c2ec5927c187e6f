// Heap memory for components that are laid out in an arena.
#include "unimapper/merge/in_arena.hpp"

#if defined(__linux__)
#include <sys/mman.h>
#endif

#include <cstdlib>
#include <new>

namespace unimapper::merge {
namespace {

constexpr std::size_t kLargePage = std::size_t{1} << 21U;

}  // namespace

Pages allocate_pages(std::size_t bytes) {
  const std::size_t alignment = bytes < kLargePage ? Arena::kAlignment : kLargePage;
  const std::size_t whole = (bytes + alignment - 1) / alignment * alignment;
  auto* memory = static_cast<std::byte*>(std::aligned_alloc(alignment, whole));
  if (memory == nullptr) throw std::bad_alloc();
#if defined(__linux__)
  // Advice only: a system without large pages refuses, and everything works as before.
  if (alignment == kLargePage) madvise(memory, whole, MADV_HUGEPAGE);
#endif
  return Pages(memory);
}

void ReleasePages::operator()(std::byte* memory) const noexcept { std::free(memory); }

}  // namespace unimapper::merge
