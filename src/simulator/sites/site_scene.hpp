// Scene of a site: its plan, its robot and the actors of a visit.
#pragma once

#include <memory>

#include "src/simulator/actor_scene.hpp"
#include "src/simulator/sites/site.hpp"

namespace unimapper::simulator::sites {

/// `build(seed, day)` makes the site, `simulate(plan, robot, visit)` the actors.
template <typename Build, typename Simulate>
std::unique_ptr<Scene> make_site_scene(const Visit& visit, const Build& build,
                                       const Simulate& simulate) {
  return std::make_unique<ActorScene<Site, Robot>>(
      visit, build,
      [&](const Plan& plan, const Robot& robot) { return simulate(plan, robot, visit); });
}

}  // namespace unimapper::simulator::sites
