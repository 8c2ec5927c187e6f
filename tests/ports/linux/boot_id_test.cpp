// Tests of random boot ids: two starts never share one.
#include "ports/linux/boot_id.hpp"

#include "tests/test.hpp"

using namespace unimapper;

TEST_CASE("every start has a boot id of its own, random in both halves") {
  constexpr std::size_t kStarts = 1000;
  std::set<std::uint64_t> high;
  std::set<std::uint64_t> low;
  for (std::size_t i = 0; i < kStarts; ++i) {
    const BootId boot = linux_port::random_boot();
    high.insert(boot.high);
    low.insert(boot.low);
  }
  CHECK(high.size() == kStarts);
  CHECK(low.size() == kStarts);
}
