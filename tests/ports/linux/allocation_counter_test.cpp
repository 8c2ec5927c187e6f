// Tests of the allocation counter.
#include "ports/linux/allocation_counter.hpp"

#include "tests/test.hpp"

using unimapper::linux_port::AllocationGuard;

namespace {

// Both hide from the compiler that the memory is not needed: it would leave the calls out.
volatile std::size_t size = 1000;
void* volatile block = nullptr;

void keep_and_free(void* memory) {
  block = memory;
  std::free(block);
}

/// Allocations counted during `work`.
template <typename Work>
std::uint64_t allocations_of(const Work& work) {
  const std::uint64_t before = AllocationGuard::count();
  {
    const AllocationGuard guard;
    work();
  }
  return AllocationGuard::count() - before;
}

}  // namespace

TEST_CASE("every way to the heap is counted") {
  CHECK(allocations_of([] {}) == 0);
  CHECK(allocations_of([] { keep_and_free(std::malloc(size)); }) == 1);
  CHECK(allocations_of([] { keep_and_free(std::calloc(size, 2)); }) == 1);
  CHECK(allocations_of([] { keep_and_free(std::realloc(nullptr, size)); }) == 1);
#ifndef __SANITIZE_THREAD__  // ThreadSanitizer puts its own in place of this one
  CHECK(allocations_of([] { keep_and_free(std::aligned_alloc(64, 64 * size)); }) == 1);
#endif
  CHECK(allocations_of([] { block = std::make_unique<std::byte[]>(size).get(); }) == 1);
  CHECK(allocations_of([] { std::string(size, 'x').shrink_to_fit(); }) >= 1);
  CHECK(allocations_of([] { std::vector<double> values(size); }) == 1);
  CHECK(allocations_of([] { Eigen::VectorXd::Zero(static_cast<Eigen::Index>(size)).eval(); }) >= 1);
}

TEST_CASE("allocations outside the guard or on other threads are not counted") {
  const std::uint64_t before = AllocationGuard::count();
  std::free(std::malloc(size));
  CHECK(AllocationGuard::count() == before);
  std::uint64_t counted_elsewhere = 1;
  std::thread other([&] {
    std::free(std::malloc(size));
    counted_elsewhere = AllocationGuard::count();
  });
  other.join();
  CHECK(counted_elsewhere == 0);
}
