// Tests of the fixed-capacity hash map.
#include "src/core/fixed_hash_map.hpp"

#include <unordered_map>

#include "tests/random.hpp"
#include "tests/test.hpp"
#include "unimapper/core/owned.hpp"

using namespace unimapper;

namespace {

using OwnedMap = Owned<FixedHashMap<int>>;

constexpr std::uint32_t kNotFound = FixedHashMap<int>::kNotFound;

/// Keys that all start at the same slot of a table with `slots` slots.
std::vector<std::uint64_t> colliding_keys(std::size_t count, std::uint64_t slots) {
  std::vector<std::uint64_t> keys;
  for (std::uint64_t key = 0; keys.size() < count; ++key) {
    if ((mix_bits(key) & (slots - 1)) == 0) keys.push_back(key);
  }
  return keys;
}

}  // namespace

TEST_CASE("a map without memory finds nothing and refuses everything") {
  FixedHashMap<int> map;
  CHECK(map.find(3) == kNotFound);
  CHECK(map.find_or_insert(3) == kNotFound);
  map.clear();
  CHECK(map.size() == 0);
  OwnedMap none(0);
  CHECK(none->find_or_insert(3) == kNotFound);
}

TEST_CASE("entries lie in the order of their insertion") {
  OwnedMap owned(100);
  for (std::uint64_t key = 100; key > 0; --key) owned->find_or_insert(key * 977);
  for (std::uint32_t i = 0; i < 100; ++i) CHECK(owned->key(i) == (100 - i) * 977);
}

TEST_CASE("a map is empty after a reset, whatever was written to its memory") {
  Arena measuring = Arena::measuring();
  FixedHashMap<int> map;
  map.allocate(measuring, 50);
  alignas(Arena::kAlignment) static std::byte memory[4096];
  REQUIRE(measuring.used() <= sizeof memory);
  Arena arena(memory, sizeof memory);
  map.allocate(arena, 50);
  for (int garbage = 0; garbage < 256; ++garbage) {
    std::fill(std::begin(memory), std::end(memory), static_cast<std::byte>(garbage));
    map.reset();
    for (std::uint64_t key = 0; key < 50; ++key) {
      REQUIRE(map.find(key) == kNotFound);
      REQUIRE(map.find_or_insert(key) == key);
    }
  }
}

TEST_CASE("refusals are counted since the last clearing") {
  OwnedMap owned(2);
  for (std::uint64_t key = 1; key <= 5; ++key) owned->find_or_insert(key);
  CHECK(owned->full());
  CHECK(owned->refused() == 3);
  // Looking up an entry that is there, or one that is not, refuses nothing.
  owned->find_or_insert(1);
  CHECK(owned->find(5) == kNotFound);
  CHECK(owned->refused() == 3);
  owned->clear();
  CHECK(owned->refused() == 0);
  for (std::uint64_t key = 1; key <= 3; ++key) owned->find_or_insert(key);
  CHECK(owned->refused() == 1);
}

TEST_CASE("every key may be used, whatever its bits") {
  OwnedMap owned(4);
  for (const std::uint64_t key : {std::uint64_t{0}, ~std::uint64_t{0}, std::uint64_t{1} << 63U}) {
    const std::uint32_t entry = owned->find_or_insert(key);
    REQUIRE(entry != kNotFound);
    CHECK(owned->key(entry) == key);
    CHECK(owned->find(key) == entry);
  }
}

TEST_CASE("keys that collide are told apart until the probe bound, then refused and counted") {
  constexpr std::size_t kCapacity = 256;
  OwnedMap owned(kCapacity);
  const auto keys = colliding_keys(FixedHashMap<int>::kMaxProbes + 5, kCapacity * 2);
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const bool fits = i < FixedHashMap<int>::kMaxProbes;
    CHECK((owned->find_or_insert(keys[i]) != kNotFound) == fits);
  }
  CHECK(owned->refused() == 5);
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const std::uint32_t expected =
        i < FixedHashMap<int>::kMaxProbes ? static_cast<std::uint32_t>(i) : kNotFound;
    CHECK(owned->find(keys[i]) == expected);
  }
}

TEST_CASE("the map agrees with std::unordered_map over many generations") {
  OwnedMap owned(500);
  test::Random random(1);
  for (int generation = 0; generation < 20; ++generation) {
    owned->clear();
    std::unordered_map<std::uint64_t, int> model;
    for (int step = 0; step < 2000; ++step) {
      const std::uint64_t key = random.below(800);
      if (random.below(2) == 0) {
        const std::uint32_t entry = owned->find(key);
        REQUIRE((entry != kNotFound) == (model.count(key) == 1));
        if (entry != kNotFound) REQUIRE((*owned)[entry] == model[key]);
      } else if (model.count(key) == 1 || model.size() < 500) {
        const std::uint32_t entry = owned->find_or_insert(key);
        REQUIRE(entry != kNotFound);
        (*owned)[entry] += step;
        model[key] += step;
      } else {
        REQUIRE(owned->find_or_insert(key) == kNotFound);
      }
    }
    CHECK(owned->size() == model.size());
    for (std::uint32_t i = 0; i < owned->size(); ++i) {
      REQUIRE((*owned)[i] == model.at(owned->key(i)));
    }
  }
}

TEST_CASE("erased keys are gone, and all others are found, in whatever order they collide") {
  test::Random random(5);
  OwnedMap map(200);
  std::unordered_map<std::uint64_t, int> expected;
  const std::vector<std::uint64_t> colliding = colliding_keys(40, 512);
  for (int i = 0; i < 5000; ++i) {
    const std::uint64_t key = i % 3 == 0 ? colliding[random.below(40)] : random.below(150);
    if (random.below(2) == 0) {
      (*map)[map->find_or_insert(key)] = i;
      expected[key] = i;
    } else if (const std::uint32_t entry = map->find(key); entry != kNotFound) {
      map->erase(entry);
      expected.erase(key);
    }
    REQUIRE(map->size() == expected.size());
    CHECK((map->find(key) == kNotFound) == (expected.count(key) == 0));
  }
  for (const auto& [key, value] : expected) CHECK((*map)[map->find(key)] == value);
  for (std::uint32_t i = map->size(); i > 0; --i) map->erase(0);
  CHECK(map->size() == 0);
  for (const std::uint64_t key : colliding) CHECK(map->find(key) == kNotFound);
}
