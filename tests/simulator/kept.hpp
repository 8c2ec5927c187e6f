// What stays in its place from one day to another.
#pragma once

#include <cmath>
#include <cstdint>
#include <set>
#include <utility>

#include "src/simulator/world.hpp"

namespace unimapper::simulator::test {

/// Places of the instances of some prototypes, to the centimetre.
inline std::set<std::pair<std::int64_t, std::int64_t>> places_of(const World& world,
                                                                 PrototypeRange range) {
  std::set<std::pair<std::int64_t, std::int64_t>> places;
  for (const Instance& i : world.instances) {
    if (i.prototype < range.first || i.prototype >= range.first + range.count) continue;
    places.insert({std::llround(100 * i.frame.origin.x), std::llround(100 * i.frame.origin.y)});
  }
  return places;
}

/// Share of them that stand in the same place on the other day.
inline double kept_share(const World& one_day, const World& other_day, PrototypeRange range) {
  const auto one = places_of(one_day, range);
  const auto other = places_of(other_day, range);
  std::size_t same = 0;
  for (const auto& place : one) same += other.contains(place) ? 1 : 0;
  return static_cast<double>(same) / static_cast<double>(one.size());
}

}  // namespace unimapper::simulator::test
