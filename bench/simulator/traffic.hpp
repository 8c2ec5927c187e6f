// Simulates who goes where, tick by tick, before the first ray is cast.
#pragma once

#include <deque>
#include <vector>

#include "actors.hpp"

namespace unimapper::simulator {

class Traffic {
 public:
  Traffic(const TownPlan& plan, const RobotMotion& robot, std::uint64_t seed, std::uint32_t day,
          double duration_s);

  /// The simulated actors; their paths belong to this object.
  std::vector<Actor> take_actors() { return std::move(actors_); }

 private:
  void add_convoy(Random& random);
  void add_persons(std::uint64_t seed, std::uint32_t day);

  const TownPlan& plan_;
  const RobotMotion& robot_;
  std::size_t ticks_;
  std::deque<Path> paths_;
  std::vector<Actor> actors_;
};

}  // namespace unimapper::simulator
