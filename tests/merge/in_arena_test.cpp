// Tests of heap memory for components of the core.
#include "unimapper/merge/in_arena.hpp"

#include <catch2/catch.hpp>
#include <cstdint>
#include <cstring>

#include "unimapper/place/database.hpp"

using namespace unimapper;
using namespace unimapper::merge;

TEST_CASE("pages suit an arena, however many there are") {
  for (const std::size_t bytes :
       {std::size_t{1}, std::size_t{1000}, (std::size_t{1} << 21U) - 1, std::size_t{5'000'000}}) {
    const Pages pages = allocate_pages(bytes);
    REQUIRE(pages != nullptr);
    CHECK(reinterpret_cast<std::uintptr_t>(pages.get()) % Arena::kAlignment == 0);
    std::memset(pages.get(), 0xA5, bytes);
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
