// Test of sets of sequence numbers against a plain set.
#include "ports/spool/sequence_set.hpp"

#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::spool;

TEST_CASE("runs of numbers hold what was inserted, whatever the order") {
  std::uint32_t random = 1;
  const auto below = [&](std::uint32_t limit) {
    random = random * 1664525U + 1013904223U;
    return (random >> 8U) % limit;
  };
  for (int round = 0; round < 200; ++round) {
    SequenceSet runs;
    std::set<std::uint64_t> plain;
    for (int i = 0; i < 20; ++i) {
      const std::uint64_t begin = below(60);
      const std::uint64_t end = begin + below(6);
      runs.insert({begin, end});
      for (std::uint64_t n = begin; n < end; ++n) plain.insert(n);
    }
    CHECK(runs.count() == plain.size());
    CHECK(runs.empty() == plain.empty());
    for (std::uint64_t n = 0; n < 70; ++n) CHECK(runs.contains(n) == plain.contains(n));
    const auto ranges = runs.ranges();
    for (std::size_t i = 1; i < ranges.size(); ++i) CHECK(ranges[i - 1].end < ranges[i].begin);
  }
}
