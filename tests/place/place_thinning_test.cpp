// Tests of the thinning of a full place database.
#include "src/place/place_thinning.hpp"

#include "synthetic_place.hpp"
#include "tests/test.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::place;
using test::Random;

/// Places of session 1, looking ahead, at so many metres along x.
void add_at(PlaceThinning& thinning, std::uint32_t slot, double x) {
  thinning.add(slot, 1, test::standing_at(x, 0, 0, 0));
}

}  // namespace

TEST_CASE("of the two places nearest to each other the older can be spared") {
  Owned<PlaceThinning> thinning(8);
  add_at(*thinning, 0, 0);
  add_at(*thinning, 1, 50);
  add_at(*thinning, 2, 53);
  add_at(*thinning, 3, 100);
  CHECK(thinning->most_redundant() == 1);
  thinning->remove(1);
  add_at(*thinning, 1, 1);
  CHECK(thinning->most_redundant() == 0);
}

TEST_CASE("places with another heading or session make no place redundant") {
  Owned<PlaceThinning> thinning(8);
  add_at(*thinning, 0, 0);
  thinning->add(1, 1, test::standing_at(0, 0, 0, 3.1415));
  thinning->add(2, 2, test::standing_at(0, 0, 0, 0));
  add_at(*thinning, 3, 100);
  add_at(*thinning, 4, 106);
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
    add_at(*thinning, slot, x);
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
  add_at(*thinning, 0, 500);
  for (std::uint32_t i = 1; i < 20; ++i) add_at(*thinning, i, 0);
  for (std::uint32_t i = 1; i < 60; ++i) {
    const std::uint32_t slot = thinning->most_redundant();
    CHECK(slot != 0);
    thinning->remove(slot);
    add_at(*thinning, slot, 0);
  }
}
