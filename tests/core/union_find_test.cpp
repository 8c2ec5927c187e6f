// Tests of disjoint sets.
#include "src/core/union_find.hpp"

#include "tests/test.hpp"

using namespace unimapper;

TEST_CASE("Joined elements share the smallest root whatever the order of joins", "[union_find]") {
  std::array<unsigned, 8> parents{};
  std::iota(parents.begin(), parents.end(), 0U);
  const auto parent = [&](unsigned i) -> unsigned& { return parents[i]; };
  const bool upwards = GENERATE(false, true);
  for (unsigned i = 0; i < 3; ++i) {
    const unsigned k = upwards ? i : 2 - i;  // 2-3, 3-5, 5-7
    constexpr unsigned kChain[] = {2, 3, 5, 7};
    CHECK(join_sets(kChain[k + 1], kChain[k], parent));
  }
  CHECK_FALSE(join_sets(7U, 2U, parent));
  for (const unsigned i : {2U, 3U, 5U, 7U}) CHECK(find_root(i, parent) == 2);
  for (const unsigned i : {0U, 1U, 4U, 6U}) CHECK(find_root(i, parent) == i);
}

TEST_CASE("A search for the root shortens the path", "[union_find]") {
  std::array<unsigned, 9> parents{0, 0, 1, 2, 3, 4, 5, 6, 7};
  const auto parent = [&](unsigned i) -> unsigned& { return parents[i]; };
  CHECK(find_root(8U, parent) == 0);
  unsigned steps = 0;
  for (unsigned i = 8; i != 0; i = parents[i]) ++steps;
  CHECK(steps == 4);
}
