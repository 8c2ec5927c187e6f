// The town as triangles: one large mesh, and prototypes that stand in many places.
#pragma once

#include <cstdint>
#include <vector>

#include "mesh.hpp"
#include "town_plan.hpp"

namespace unimapper::simulator {

/// One placement of a prototype. `label` is that of surfaces without a label of their own.
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
  TownPlan plan;
  Mesh mesh;
  Prototypes prototypes;
  std::vector<Instance> instances;
};

/// Builds the town of `seed` as it stands on `day`: parked cars and some furniture differ.
World build_town(std::uint64_t seed, std::uint32_t day);

// Contributions of the single files; `build_town` calls them in order.
void build_prototypes(std::uint64_t seed, Prototypes& prototypes);
void add_plant_prototypes(std::uint64_t seed, Prototypes& prototypes);
void add_vehicle_prototypes(Prototypes& prototypes);
void add_person_prototypes(Prototypes& prototypes);
void add_furniture_prototypes(Prototypes& prototypes);

void add_ground(std::uint64_t seed, World& world);
void add_blocks(std::uint64_t seed, World& world);
void add_street_furniture(std::uint64_t seed, std::uint32_t day, World& world);
void add_parked_cars(std::uint64_t seed, std::uint32_t day, World& world);

/// What stands on a block.
enum class BlockKind { kBuilt, kPark, kPlaza };
BlockKind block_kind(std::uint64_t seed, int column, int row);

/// Puts one house into `mesh`: `frame` has x along the front, y into the lot, z up.
struct HouseShape {
  double width, depth, storey_height, ground_drop;
  int storeys;
  bool has_shop;
};
class Random;
void add_house(Mesh& mesh, const Frame& frame, const HouseShape& shape, Random& random);

}  // namespace unimapper::simulator
