#include "town.hpp"

namespace unimapper::simulator {

Town build_town(std::uint64_t seed, std::uint32_t day) {
  Town town(seed);
  build_prototypes(seed, town.prototypes);
  add_ground(seed, town);
  add_blocks(seed, town);
  add_street_furniture(seed, day, town);
  add_parked_cars(seed, day, town);
  return town;
}

}  // namespace unimapper::simulator
