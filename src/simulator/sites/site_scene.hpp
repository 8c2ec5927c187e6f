// Scene of a site: its plan, its robot and the actors of a visit.
#pragma once

#include <cstdint>
#include <memory>

#include "src/simulator/actor_scene.hpp"
#include "src/simulator/sites/site.hpp"
#include "src/simulator/strolling.hpp"

namespace unimapper::simulator::sites {

/// The walkers of a visit, `make(random)` one of `count`; `scene` tells their random numbers from
/// those of other scenes.
template <typename Make>
ActorSet simulate_walkers(const Robot& robot, const Visit& visit, std::uint64_t scene, int count,
                          const Make& make) {
  ActorSet set;
  Random random(visit.seed, Stream::kPedestrian, visit.day, scene);
  const auto robot_at = [&](double time_s) { return robot.at(time_s); };
  const std::size_t ticks = tick_count(visit.duration_s);
  Strolling strolling(robot_at, ticks, random, set);
  for (int i = 0; i < count; ++i) strolling.add(make(random));
  strolling.run();
  remove_colliding_actors(robot_at, ticks, set);
  return set;
}

/// A walker on one of the first two walks of a plan, who may stop now and then.
inline Stroller walker_on_either(const Plan& plan, Random& random) {
  Stroller s;
  s.path = &plan.walks[random.index(2)];
  s.cruise = random.uniform(0.8, 1.4);
  s.pauses_per_s = random.chance(0.5) ? 1.0 / 15.0 : 0.0;
  s.at = random.uniform(0.0, s.path->length());
  return s;
}

/// `build(seed, day)` makes the site, `simulate(plan, robot, visit)` the actors.
template <typename Build, typename Simulate>
std::unique_ptr<Scene> make_site_scene(const Visit& visit, const Build& build,
                                       const Simulate& simulate) {
  return std::make_unique<ActorScene<Site, Robot>>(
      visit, build,
      [&](const Plan& plan, const Robot& robot) { return simulate(plan, robot, visit); });
}

}  // namespace unimapper::simulator::sites
