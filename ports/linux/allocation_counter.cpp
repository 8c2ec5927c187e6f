// Interposed malloc family that counts allocations.
//
// It is defined in the executable, in front of the C library's: replacing operator new would miss
// malloc and Eigen, wrapping malloc at link time would miss what the standard library allocates.
#include "ports/linux/allocation_counter.hpp"

#include <cerrno>
#include <cstddef>

namespace unimapper::linux_port {
namespace {

// The initial-exec model is what an executable has anyway; said here because any other one might
// allocate on first use.
__attribute__((tls_model("initial-exec"))) thread_local bool armed = false;
__attribute__((tls_model("initial-exec"))) thread_local std::uint64_t allocations = 0;

inline void note_allocation() noexcept {
  if (armed) ++allocations;
}

}  // namespace

AllocationGuard::AllocationGuard() noexcept { armed = true; }
AllocationGuard::~AllocationGuard() { armed = false; }
std::uint64_t AllocationGuard::count() noexcept { return allocations; }

}  // namespace unimapper::linux_port

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)

// Sanitizers have a malloc of their own, with hooks.
extern "C" int __sanitizer_install_malloc_and_free_hooks(void (*malloc_hook)(const volatile void*,
                                                                             std::size_t),
                                                         void (*free_hook)(const volatile void*));

namespace {
const int installed = __sanitizer_install_malloc_and_free_hooks(
    [](const volatile void*, std::size_t) { unimapper::linux_port::note_allocation(); },
    [](const volatile void*) {});
}  // namespace

#else

extern "C" {

// The C library's own names.
// NOLINTBEGIN(bugprone-reserved-identifier)
void* __libc_malloc(std::size_t bytes);
void* __libc_calloc(std::size_t count, std::size_t bytes);
void* __libc_realloc(void* block, std::size_t bytes);
void* __libc_memalign(std::size_t alignment, std::size_t bytes);
void __libc_free(void* block);
// NOLINTEND(bugprone-reserved-identifier)

void* malloc(std::size_t bytes) {
  unimapper::linux_port::note_allocation();
  return __libc_malloc(bytes);
}

void* calloc(std::size_t count, std::size_t bytes) {
  unimapper::linux_port::note_allocation();
  return __libc_calloc(count, bytes);
}

void* realloc(void* block, std::size_t bytes) {
  unimapper::linux_port::note_allocation();
  return __libc_realloc(block, bytes);
}

void* memalign(std::size_t alignment, std::size_t bytes) {
  unimapper::linux_port::note_allocation();
  return __libc_memalign(alignment, bytes);
}

void* aligned_alloc(std::size_t alignment, std::size_t bytes) {
  unimapper::linux_port::note_allocation();
  return __libc_memalign(alignment, bytes);
}

int posix_memalign(void** block, std::size_t alignment, std::size_t bytes) {
  unimapper::linux_port::note_allocation();
  const bool is_power_of_two = alignment != 0 && (alignment & (alignment - 1)) == 0;
  if (!is_power_of_two || alignment % sizeof(void*) != 0) return EINVAL;
  *block = __libc_memalign(alignment, bytes);
  return *block == nullptr ? ENOMEM : 0;
}

void free(void* block) { __libc_free(block); }

}  // extern "C"

#endif
