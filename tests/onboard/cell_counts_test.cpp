// Bit-sliced counters against plain counting
#include "src/onboard/removal/cell_counts.hpp"

#include "tests/random.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::onboard;

TEST_CASE("a cell is counted once for every word that holds it, for any number of words") {
  test::Random random(7);
  for (std::size_t count = 0; count <= 63; ++count) {
    std::vector<std::uint64_t> words(count);
    // The first cell is in all of them, the last one in none.
    for (std::uint64_t& word : words) word = (random.bits() | 1U) & ~(std::uint64_t{1} << 63U);
    const CellCounts counts(words);
    for (std::uint32_t bit = 0; bit < 64; ++bit) {
      std::int32_t expected = 0;
      for (const std::uint64_t word : words) expected += (word >> bit & 1U) != 0 ? 1 : 0;
      REQUIRE(counts.of(bit) == expected);
    }
  }
}
