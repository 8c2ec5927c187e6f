// Comparison of static instances between two days.
#pragma once

#include "src/simulator/world.hpp"
#include "tests/test.hpp"

namespace unimapper::simulator::test {

/// Positions of the instances of some prototypes, to the centimetre.
inline std::set<std::pair<std::int64_t, std::int64_t>> positions_of(const World& world,
                                                                    PrototypeRange range) {
  std::set<std::pair<std::int64_t, std::int64_t>> positions;
  for (const Instance& i : world.instances) {
    if (i.prototype < range.first || i.prototype >= range.first + range.count) continue;
    positions.insert({std::llround(100 * i.frame.origin.x), std::llround(100 * i.frame.origin.y)});
  }
  return positions;
}

/// Share of instances at the same position on the other day.
inline double kept_share(const World& one_day, const World& other_day, PrototypeRange range) {
  const auto one = positions_of(one_day, range);
  const auto other = positions_of(other_day, range);
  std::size_t same = 0;
  for (const auto& position : one) same += other.contains(position) ? 1 : 0;
  return static_cast<double>(same) / static_cast<double>(one.size());
}

}  // namespace unimapper::simulator::test
