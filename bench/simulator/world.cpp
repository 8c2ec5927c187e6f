#include "world.hpp"

namespace unimapper::simulator {

void build_prototypes(std::uint64_t seed, Prototypes& prototypes) {
  add_plant_prototypes(seed, prototypes);
  add_vehicle_prototypes(prototypes);
  add_person_prototypes(prototypes);
  add_furniture_prototypes(prototypes);
}

World build_town(std::uint64_t seed, std::uint32_t day) {
  World world{TownPlan(seed), {}, {}, {}};
  build_prototypes(seed, world.prototypes);
  add_ground(seed, world);
  add_blocks(seed, world);
  add_street_furniture(seed, day, world);
  add_parked_cars(seed, day, world);
  return world;
}

}  // namespace unimapper::simulator
