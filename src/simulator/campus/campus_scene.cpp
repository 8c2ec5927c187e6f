// Campus scene: a small robot among pedestrians.
#include "campus.hpp"
#include "crowd.hpp"
#include "src/simulator/actor_scene.hpp"

namespace unimapper::simulator {

std::unique_ptr<Scene> make_campus_scene(const Visit& visit) {
  using namespace campus;
  const auto simulate = [&](const Plan& plan, const RobotWalk& robot) {
    return simulate_crowd(plan, robot, visit.seed, visit.day, visit.duration_s);
  };
  return std::make_unique<ActorScene<Campus, RobotWalk>>(visit, build_campus, simulate);
}

}  // namespace unimapper::simulator
