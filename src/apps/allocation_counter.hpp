// Counts heap allocations of one thread, to prove that a stretch of code makes none.
#pragma once

#include <cstdint>

namespace unimapper::apps {

/// While one of these lives, allocations of its thread through malloc, calloc, realloc and
/// their aligned relatives are counted, whoever makes them: new, the C library, Eigen.
class AllocationGuard {
 public:
  AllocationGuard() noexcept;
  ~AllocationGuard();
  AllocationGuard(const AllocationGuard&) = delete;
  AllocationGuard& operator=(const AllocationGuard&) = delete;

  /// Allocations counted on this thread so far.
  [[nodiscard]] static std::uint64_t count() noexcept;
};

}  // namespace unimapper::apps
