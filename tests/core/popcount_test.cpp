// Population count against the standard library's.
#include "src/core/popcount.hpp"

#include <bit>

#include "tests/random.hpp"
#include "tests/test.hpp"

TEST_CASE("set bits are counted as the standard library counts them") {
  CHECK(unimapper::popcount(0) == 0);
  CHECK(unimapper::popcount(~0ULL) == 64);
  unimapper::test::Random random(1);
  for (int i = 0; i < 1000; ++i) {
    const std::uint64_t word = random.bits();
    REQUIRE(unimapper::popcount(word) == static_cast<std::uint32_t>(std::popcount(word)));
    REQUIRE(unimapper::popcount(word & (word >> 32U)) ==
            static_cast<std::uint32_t>(std::popcount(word & (word >> 32U))));
  }
}
