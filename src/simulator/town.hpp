// Town model: a street grid with blocks, furniture and parked cars.
#pragma once

#include "town_plan.hpp"
#include "world.hpp"

namespace unimapper::simulator {

struct Town : World {
  explicit Town(std::uint64_t seed) : plan(seed) {}
  TownPlan plan;
};

/// Builds the town of `seed` as it stands on `day`: parked cars and some furniture differ.
Town build_town(std::uint64_t seed, std::uint32_t day);

// Contributions of the single files; `build_town` calls them in order.
void add_ground(std::uint64_t seed, Town& town);
void add_blocks(std::uint64_t seed, Town& town);
void add_street_furniture(std::uint64_t seed, std::uint32_t day, Town& town);
void add_parked_cars(std::uint64_t seed, std::uint32_t day, Town& town);

/// Land use of a block.
enum class BlockKind { kBuilt, kPark, kPlaza };
BlockKind block_kind(std::uint64_t seed, int column, int row);

}  // namespace unimapper::simulator
