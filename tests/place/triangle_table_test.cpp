// Tests of the triangle hash table.
#include "src/place/triangle_table.hpp"

#include "synthetic_place.hpp"
#include "tests/test.hpp"

namespace {

using namespace unimapper;
using namespace unimapper::place;
using test::Random;

Triangle triangle(int a, int b, int c, int seed = 0) {
  Triangle t{};
  t.side_cm[0] = static_cast<std::uint16_t>(a);
  t.side_cm[1] = static_cast<std::uint16_t>(b);
  t.side_cm[2] = static_cast<std::uint16_t>(c);
  t.heading = static_cast<std::uint16_t>(seed);
  t.center_cm[0] = static_cast<std::int16_t>(seed);
  t.dot[0] = t.dot[1] = t.dot[2] = 100;
  return t;
}

std::multiset<int> slots_found(const TriangleTable& table, const Triangle& query) {
  std::multiset<int> result;
  table.find(query,
             [&](const TriangleEntry& entry) { result.insert(static_cast<int>(entry.slot)); });
  return result;
}

LoopSearchConfig small() {
  LoopSearchConfig config;
  config.max_places = 50;
  config.triangles.max_triangles = 100;
  config.side_tolerance_m = 0.2F;
  return config;
}

LoopSearchConfig large() {
  LoopSearchConfig config = small();
  config.max_places = 50000;
  return config;
}

}  // namespace

TEST_CASE("a triangle is found within the tolerance on either side and not beyond") {
  Owned<TriangleTable> table(GENERATE(small(), large()));
  REQUIRE(table->insert(triangle(500, 800, 1000), 7));
  const int tolerance = 20;
  for (int side = 0; side < 3; ++side) {
    for (const int offset : {-tolerance - 1, -tolerance, -1, 0, 1, tolerance, tolerance + 1}) {
      int s[3] = {500, 800, 1000};
      s[side] += offset;
      INFO("side " << side << " offset " << offset);
      const std::size_t expected = std::abs(offset) <= tolerance ? 1 : 0;
      CHECK(slots_found(*table, triangle(s[0], s[1], s[2])).count(7) == expected);
    }
  }
}

TEST_CASE("chirality is part of the key, and agreeing products of normals are counted") {
  Owned<TriangleTable> table(small());
  REQUIRE(table->insert(triangle(500, 800, 1000), 7));
  Triangle other = triangle(500, 800, 1000);
  other.left_handed = 1;
  CHECK(slots_found(*table, other).empty());
  other.left_handed = 0;
  const auto agreeing = [&](int a, int b, int c) {
    other.dot[0] = static_cast<std::uint8_t>(a);
    other.dot[1] = static_cast<std::uint8_t>(b);
    other.dot[2] = static_cast<std::uint8_t>(c);
    int count = -1;
    table->find(other, [&](const TriangleEntry& entry) { count = entry.agreeing_dots; });
    return count;
  };
  // Stored are 100, 100, 100, kept in 32 steps of 8; the tolerance is 0.35, 11 of them.
  CHECK(agreeing(100, 100, 100) == 3);
  CHECK(agreeing(8, 191, 100) == 3);
  CHECK(agreeing(7, 192, 100) == 1);
  CHECK(agreeing(255, 255, 0) == 0);
}

TEST_CASE("columns that differ in more bands of height than allowed are another triangle's") {
  LoopSearchConfig config = small();
  config.max_code_difference = 4;
  Owned<TriangleTable> table(config);
  Triangle stored = triangle(500, 800, 1000);
  stored.sketch[0] = stored.sketch[1] = stored.sketch[2] = 0b00001111;
  REQUIRE(table->insert(stored, 7));
  Triangle query = stored;
  query.sketch[0] = 0b00000011;  // two bands less
  query.sketch[2] = 0b00111111;  // two bands more
  CHECK(slots_found(*table, query).count(7) == 1);
  query.sketch[1] = 0b00001110;
  CHECK(slots_found(*table, query).empty());
}

TEST_CASE("entries near a triangle are at least what a search compares") {
  Owned<TriangleTable> table(small());
  CHECK(table->entries_near(triangle(500, 800, 1000)) == 0);
  for (int i = 0; i < 40; ++i) REQUIRE(table->insert(triangle(500, 800, 1000, i), 7));
  CHECK(table->entries_near(triangle(510, 790, 1010)) == 40);
  table->remove(triangle(500, 800, 1000, 3), 7);
  CHECK(table->entries_near(triangle(510, 790, 1010)) == 39);
}

TEST_CASE("a stored triangle takes at most 18 bytes") {
  STATIC_REQUIRE(TriangleTable::entry_bytes() <= 18);
}

TEST_CASE("the table agrees with comparing everything with everything") {
  // A large one has smaller cells.
  Owned<TriangleTable> table(GENERATE(small(), large()));
  Random random(1);
  const auto random_triangle = [&](int seed) {
    const int a = static_cast<int>(random.uniform(300, 700));
    const int b = a + static_cast<int>(random.uniform(0, 300));
    return triangle(a, b, b + static_cast<int>(random.uniform(0, a)), seed);
  };
  std::vector<std::pair<Triangle, int>> model;
  for (int i = 0; i < 3000; ++i) {
    model.emplace_back(random_triangle(i), i % 50 * 21399);  // up to the largest slot
    REQUIRE(table->insert(model.back().first, static_cast<std::uint32_t>(model.back().second)));
  }
  // Every third one is taken out again.
  for (std::size_t i = 0; i < model.size(); i += 3) {
    table->remove(model[i].first, static_cast<std::uint32_t>(model[i].second));
    model[i].second = -1;
  }
  for (int q = 0; q < 300; ++q) {
    const Triangle query = random_triangle(0);
    std::multiset<int> expected;
    for (const auto& [t, place] : model) {
      bool equal = place >= 0;
      for (int i = 0; i < 3; ++i) equal &= std::abs(t.side_cm[i] - query.side_cm[i]) <= 20;
      if (equal) expected.insert(place);
    }
    REQUIRE(slots_found(*table, query) == expected);
  }
}

TEST_CASE("a bucket takes no more than its limit, and removed entries make room") {
  LoopSearchConfig config = small();
  config.max_bucket = 40;
  Owned<TriangleTable> table(config);
  int stored = 0;
  for (int i = 0; i < 100; ++i) stored += table->insert(triangle(500, 800, 1000, i), 1) ? 1 : 0;
  REQUIRE(stored == 40);
  table->remove(triangle(500, 800, 1000, 5), 1);
  REQUIRE(table->insert(triangle(500, 800, 1000, 200), 2));
  REQUIRE_FALSE(table->insert(triangle(500, 800, 1000, 201), 2));
  REQUIRE(slots_found(*table, triangle(500, 800, 1000)).size() == 40);
}

TEST_CASE("removing what is not there changes nothing") {
  Owned<TriangleTable> table(small());
  table->remove(triangle(500, 800, 1000), 1);
  REQUIRE(table->insert(triangle(500, 800, 1000), 1));
  table->remove(triangle(500, 800, 1000), 2);
  table->remove(triangle(501, 800, 1000, 3), 1);
  REQUIRE(slots_found(*table, triangle(500, 800, 1000)).size() == 1);
}

TEST_CASE("a table that never got memory stores and finds nothing") {
  TriangleTable table;
  REQUIRE_FALSE(table.insert(triangle(500, 800, 1000), 1));
  table.remove(triangle(500, 800, 1000), 1);
  Arena measuring = Arena::measuring();
  table.allocate(measuring, small());
  REQUIRE(slots_found(table, triangle(500, 800, 1000)).empty());
}
