// Malloc family that counts. Include it in one file of an executable of its own.
//
// It is defined in the executable because replacing operator new would miss malloc, and wrapping
// malloc at link time would miss what libstdc++ allocates. Build with -fno-builtin: the compiler
// must not assume that malloc and free come in pairs that can be removed.
#pragma once

#include <cerrno>
#include <cstddef>

namespace {

bool counting = false;
unsigned long allocations = 0;

void count() { allocations += counting ? 1U : 0U; }

}  // namespace

extern "C" {

void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* block);

void* malloc(std::size_t size) {
  count();
  return __libc_malloc(size);
}
void* calloc(std::size_t elements, std::size_t size) {
  count();
  return __libc_calloc(elements, size);
}
void* realloc(void* old, std::size_t size) {
  count();
  return __libc_realloc(old, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
  count();
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  count();
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** out, std::size_t alignment, std::size_t size) {
  count();
  *out = __libc_memalign(alignment, size);
  return *out == nullptr ? ENOMEM : 0;
}
void free(void* block) { __libc_free(block); }
}
