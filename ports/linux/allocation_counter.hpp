// Per-thread counter of heap allocations.
//
// Link unimapper_allocation_counter into the executable: it replaces the malloc family there.
#pragma once

#include <cstdint>

namespace unimapper::linux_port {

/// During its lifetime, allocations of its thread through malloc, calloc, realloc and their
/// aligned variants are counted, including those by new, the C library and Eigen.
class AllocationGuard {
 public:
  AllocationGuard() noexcept;
  ~AllocationGuard();
  AllocationGuard(const AllocationGuard&) = delete;
  AllocationGuard& operator=(const AllocationGuard&) = delete;

  /// Allocations counted on this thread so far.
  [[nodiscard]] static std::uint64_t count() noexcept;
};

}  // namespace unimapper::linux_port
