#include "crowd.hpp"

#include <algorithm>

#include "src/simulator/random.hpp"

namespace unimapper::simulator::campus {
namespace {

/// Smallest allowed distance (m) between an actor and the robot's centre.
double least_distance(ActorKind kind) {
  if (kind == ActorKind::kVan) return 3.0;
  return kind == ActorKind::kCyclist ? 0.9 : 0.6;
}

/// The robot's trajectory is fixed, so actors that collide with it are removed altogether.
void remove_colliding_actors(const RobotWalk& robot, std::size_t ticks, ActorSet& crowd) {
  constexpr std::size_t kEvery = 2;
  std::vector<Vec2> way;
  for (std::size_t tick = 0; tick < ticks; tick += kEvery) {
    way.push_back(robot.at(Actors::time_of(tick)));
  }
  const auto is_hit = [&](const Actor& actor) {
    const double least = least_distance(actor.kind);
    for (std::size_t i = 0; i < way.size(); ++i) {
      if (norm(position(actor, i * kEvery) - way[i]) < least) return true;
    }
    return false;
  };
  std::erase_if(crowd.actors, is_hit);
}

}  // namespace

Actor make_person(const Path& path, Random& random) {
  Actor actor;
  actor.kind = ActorKind::kPerson;
  actor.variant = random.index(12);
  actor.scale = random.chance(0.06) ? random.uniform(0.62, 0.8) : random.uniform(0.93, 1.07);
  actor.path = &path;
  return actor;
}

Vec2 position(const Actor& actor, std::size_t tick) {
  const double s = actor.travelled[tick];
  const double left = actor.lateral + (actor.sidestep.empty() ? 0.0F : actor.sidestep[tick]);
  return actor.path->at(s) + left * left_of(actor.path->heading(s, 0.6));
}

bool is_clear_on_plaza(const Plan& plan, Vec2 at, double radius) {
  if (!plan.plaza().contains(at, -radius) || plan.queue().contains(at, radius)) return false;
  const auto fixtures = plan.fixtures();
  return std::all_of(fixtures.begin(), fixtures.end(), [&](const Fixture& fixture) {
    return norm(fixture.at - at) > fixture.radius + radius;
  });
}

ActorSet simulate_crowd(const Plan& plan, const RobotWalk& robot, std::uint64_t seed,
                        std::uint32_t day, double duration_s) {
  const auto ticks =
      static_cast<std::size_t>((duration_s + 2.0 * Actors::kWarmUp) / Actors::kTick) + 2;
  ActorSet crowd;
  const auto random = [&](std::uint64_t part) {
    return Random(seed, Stream::kPedestrian, day, part);
  };
  Random companions = random(1);
  add_companions(robot, ticks, companions, crowd);
  Random queue = random(2);
  add_queue(plan, ticks, queue, crowd);
  Random gatherings = random(3);
  add_gatherings(plan, ticks, gatherings, crowd);
  Random strollers = random(4);
  add_strollers(plan, robot, ticks, strollers, crowd);
  remove_colliding_actors(robot, ticks, crowd);
  return crowd;
}

}  // namespace unimapper::simulator::campus
