// Tests of components in large pages.
#include "unimapper/merge/in_arena.hpp"

#include <catch2/catch.hpp>
#include <cstdint>
#include <cstring>

#include "unimapper/place/database.hpp"

using namespace unimapper;
using namespace unimapper::merge;

TEST_CASE("a block of large pages suits an arena, however large it is") {
  for (const std::size_t bytes :
       {std::size_t{1}, std::size_t{1000}, (std::size_t{1} << 21U) - 1, std::size_t{5'000'000}}) {
    const LargePageBlock block(bytes);
    REQUIRE(block.size() >= bytes);
    CHECK(reinterpret_cast<std::uintptr_t>(block.data()) % Arena::kAlignment == 0);
    std::memset(block.data(), 0xA5, block.size());
  }
}

TEST_CASE("a component is laid out for a configuration that is valid, and for no other") {
  LoopSearchConfig config;
  config.max_places = 3;
  InArena<PlaceDatabase> database(config);
  CHECK(database.bytes() > 0);
  CHECK(database->size() == 0);
  config.max_places = 0;
  CHECK_THROWS_AS(InArena<PlaceDatabase>(config), std::invalid_argument);
}
