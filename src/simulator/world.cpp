#include "world.hpp"

namespace unimapper::simulator {

void build_prototypes(std::uint64_t seed, Prototypes& prototypes) {
  add_plant_prototypes(seed, prototypes);
  add_vehicle_prototypes(prototypes);
  add_person_prototypes(prototypes);
  add_furniture_prototypes(prototypes);
}

}  // namespace unimapper::simulator
