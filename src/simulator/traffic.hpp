// Traffic simulation of the town at a fixed time step.
#pragma once

#include <deque>
#include <vector>

#include "actors.hpp"
#include "convoy.hpp"

namespace unimapper::simulator {

class Random;

/// Drivers follow the intelligent driver model, take turns at crossings, give way to persons on the
/// road and to the robot's convoy, and stop now and then; persons walk around blocks, alone or in
/// groups, and some cross the streets. Actors that would still collide are removed.
class Traffic {
 public:
  Traffic(const TownPlan& plan, const RobotMotion& robot, std::uint64_t seed, std::uint32_t day,
          double duration_s);

  /// The simulated actors; to be called once.
  ActorSet take() { return {std::move(paths_), std::move(actors_)}; }

 private:
  struct Vehicle;
  struct Obstacle;

  void add_convoy(Random& random);
  void add_persons(std::uint64_t seed, std::uint32_t day);
  void add_group(const Path& path, double speed, Random& random);
  void remove_colliding_persons();
  void add_vehicles(Random& random);
  [[nodiscard]] Vehicle random_vehicle(ActorKind kind, Random& random);
  void drive(std::vector<Vehicle>& vehicles, Random& random);
  void step(std::vector<Vehicle>& vehicles, std::size_t self, double time_s,
            const std::vector<Obstacle>& obstacles, Random& random);
  [[nodiscard]] double gap_to_stop_line(Vehicle& vehicle, std::size_t self, double time_s);
  [[nodiscard]] std::vector<Obstacle> obstacles_at(const std::vector<Vehicle>& vehicles,
                                                   std::size_t tick) const;

  const TownPlan& plan_;
  std::size_t ticks_;
  Convoy convoy_;
  std::deque<Path> paths_;
  std::vector<Actor> actors_;
  std::vector<int> crossing_holder_;  // per crossing: index of the vehicle on it, or -1
};

}  // namespace unimapper::simulator
