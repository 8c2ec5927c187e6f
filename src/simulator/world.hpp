// Static geometry of a scene: one mesh, and instances of prototypes.
#pragma once

#include <cstdint>
#include <vector>

#include "mesh.hpp"

namespace unimapper::simulator {

/// One instance of a prototype. `label` is that of surfaces without a label of their own.
struct Instance {
  std::uint32_t prototype = 0;
  Frame frame;
  double scale = 1.0;
  std::uint16_t label = 0;
  std::uint16_t object = 0;  ///< instance id for the upper half of a label; 0 = none
};

/// First prototype of each kind and how many variants there are.
struct PrototypeRange {
  std::uint32_t first = 0, count = 0;
};

struct Prototypes {
  std::vector<Mesh> meshes;
  PrototypeRange trees, bushes, hedges, cars, vans, buses, lamps, utility_poles, signs,
      traffic_lights, bins, benches, cabinets, bollards, shelters, bicycles;
  /// Persons come in parts that move against each other: torso, leg, arm per variant.
  PrototypeRange torsos, legs, arms, cyclists;
};

struct World {
  Mesh mesh;
  Prototypes prototypes;
  std::vector<Instance> instances;
};

/// Makes the prototypes that every scene has; the plants differ from seed to seed.
void build_prototypes(std::uint64_t seed, Prototypes& prototypes);

// Contributions of the single files; `build_prototypes` calls them in order.
void add_plant_prototypes(std::uint64_t seed, Prototypes& prototypes);
void add_vehicle_prototypes(Prototypes& prototypes);
void add_person_prototypes(Prototypes& prototypes);
void add_furniture_prototypes(Prototypes& prototypes);

/// Puts one house into `mesh`: `frame` has x along the front, y into the lot, z up.
struct HouseShape {
  double width, depth, storey_height, ground_drop;
  int storeys;
  bool has_shop;
};
class Random;
void add_house(Mesh& mesh, const Frame& frame, const HouseShape& shape, Random& random);

}  // namespace unimapper::simulator
