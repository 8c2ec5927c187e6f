// Campus model: halls around a plaza, paths, lawns and a park for pedestrians.
#pragma once

#include "plan.hpp"
#include "src/simulator/world.hpp"

namespace unimapper::simulator {
class Random;
}

namespace unimapper::simulator::campus {

struct Campus : World {
  explicit Campus(std::uint64_t seed) : plan(seed) {}
  Plan plan;
};

/// Builds the campus of `seed` as it stands on `day`: bicycles, parked cars, stalls and boards
/// differ.
Campus build_campus(std::uint64_t seed, std::uint32_t day);

// Contributions of the single files; `build_campus` calls them in order.
void add_grounds(std::uint64_t seed, Campus& campus);
void add_terrace(Campus& campus);
void add_halls(std::uint64_t seed, Campus& campus);
void add_plaza(std::uint64_t seed, std::uint32_t day, Campus& campus);
void add_greenery(std::uint64_t seed, Campus& campus);
void add_path_furniture(std::uint64_t seed, std::uint32_t day, Campus& campus);
void add_bicycles_and_cars(std::uint64_t seed, std::uint32_t day, Campus& campus);

/// Adds a prototype that stands upright on the ground.
void add_instance(Campus& campus, PrototypeRange range, std::uint32_t variant, Vec2 at, double turn,
                  double scale = 1.0, std::uint16_t label = 0, std::uint16_t object = 0);

}  // namespace unimapper::simulator::campus
