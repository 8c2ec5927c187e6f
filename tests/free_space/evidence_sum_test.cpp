// Evidence of cells that are classified together
#include "src/free_space/evidence_sum.hpp"

#include "tests/test.hpp"

using namespace unimapper;

namespace {

EvidenceSum sum_of(std::uint32_t cells, std::int32_t log_odds, std::uint32_t occupied) {
  EvidenceSum sum;
  for (std::uint32_t i = 0; i < cells; ++i) sum.add(log_odds, occupied);
  return sum;
}

}  // namespace

TEST_CASE("evidence of two sets of cells adds up", "[free space]") {
  EvidenceSum sum = sum_of(3, 400, 1);
  sum += sum_of(1, -500, 2);
  CHECK(sum.cells == 4);
  CHECK(sum.dynamic == 3);
  CHECK(sum.occupied == 5);
  CHECK(sum.mean() == 175);
  CHECK(EvidenceSum{}.mean() == 0);
}

TEST_CASE("a part moved if it meets all four conditions", "[free space]") {
  constexpr MovedPart kRule{10, 300, 0.5F};
  CHECK(kRule.holds(sum_of(10, 300, 0)));
  CHECK_FALSE(kRule.holds(sum_of(9, 300, 0)));
  CHECK_FALSE(kRule.holds(sum_of(10, 299, 0)));
  CHECK_FALSE(kRule.holds(sum_of(10, 300, 1)));

  EvidenceSum two_fifths = sum_of(4, 900, 1);
  two_fifths += sum_of(6, 0, 0);
  CHECK(kRule.holds(two_fifths));
  two_fifths += sum_of(1, 0, 0);
  CHECK_FALSE(kRule.holds(two_fifths));
}
