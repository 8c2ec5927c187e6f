// Tests of the thinning of a full place database.
#include "src/place/place_thinning.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "synthetic_place.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::place;
using test::Random;
using test::standing_at;

}  // namespace

TEST_CASE("of the two places nearest to each other the older can be spared") {
  Owned<PlaceThinning> thinning(8);
  thinning->add(0, 1, standing_at(0, 0, 0, 0));
  thinning->add(1, 1, standing_at(50, 0, 0, 0));
  thinning->add(2, 1, standing_at(53, 0, 0, 0));
  thinning->add(3, 1, standing_at(100, 0, 0, 0));
  CHECK(thinning->most_redundant() == 1);
  thinning->remove(1);
  thinning->add(1, 1, standing_at(1, 0, 0, 0));
  CHECK(thinning->most_redundant() == 0);
}

TEST_CASE("places with another heading or session make no place redundant") {
  Owned<PlaceThinning> thinning(8);
  thinning->add(0, 1, standing_at(0, 0, 0, 0));
  thinning->add(1, 1, standing_at(0, 0, 0, 3.1415));
  thinning->add(2, 2, standing_at(0, 0, 0, 0));
  thinning->add(3, 1, standing_at(100, 0, 0, 0));
  thinning->add(4, 1, standing_at(106, 0, 0, 0));
  CHECK(thinning->most_redundant() == 3);
}

TEST_CASE("a street driven again and again keeps its length, and rare places stay") {
  constexpr std::uint32_t kSlots = 60;
  Owned<PlaceThinning> thinning(kSlots);
  std::vector<double> at(kSlots);
  std::uint32_t used = 0;
  const auto insert = [&](double x) {
    std::uint32_t slot = used;
    if (used == kSlots) {
      slot = thinning->most_redundant();
      thinning->remove(slot);
    } else {
      ++used;
    }
    thinning->add(slot, 1, standing_at(x, 0, 0, 0));
    at[slot] = x;
  };
  insert(-1000);
  Random random(1);
  // Thirty rounds of 300 m, a keyframe every seven metres: 1300 places.
  for (int round = 0; round < 30; ++round) {
    for (double x = 0; x < 300; x += 7) insert(x + random.uniform(-1, 1));
  }
  std::sort(at.begin(), at.end());
  CHECK(at[0] == -1000);
  // Nowhere on the street is a gap of more than two keyframes.
  for (std::size_t i = 2; i < at.size(); ++i) CHECK(at[i] - at[i - 1] < 15);
  CHECK(at.back() > 285);
}

TEST_CASE("a robot that stands still forgets its oldest places there first") {
  Owned<PlaceThinning> thinning(20);
  thinning->add(0, 1, standing_at(500, 0, 0, 0));
  for (std::uint32_t i = 1; i < 20; ++i) thinning->add(i, 1, standing_at(0, 0, 0, 0));
  for (std::uint32_t i = 1; i < 60; ++i) {
    const std::uint32_t slot = thinning->most_redundant();
    CHECK(slot != 0);
    thinning->remove(slot);
    thinning->add(slot, 1, standing_at(0, 0, 0, 0));
  }
}
