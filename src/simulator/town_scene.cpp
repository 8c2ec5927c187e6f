// Town scene: a car with a sensor mast in traffic.
#include "actor_scene.hpp"
#include "robot_motion.hpp"
#include "town.hpp"
#include "traffic.hpp"

namespace unimapper::simulator {

std::unique_ptr<Scene> make_town_scene(const Visit& visit) {
  const auto simulate = [&](const TownPlan& plan, const RobotMotion& robot) {
    return Traffic(plan, robot, visit.seed, visit.day, visit.duration_s).take();
  };
  return std::make_unique<ActorScene<Town, RobotMotion>>(visit, build_town, simulate);
}

}  // namespace unimapper::simulator
