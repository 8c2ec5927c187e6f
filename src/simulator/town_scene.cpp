// Town scenes: a car with a sensor mast in traffic that flows or stops and goes.
#include "actor_scene.hpp"
#include "robot_motion.hpp"
#include "town.hpp"
#include "traffic.hpp"

namespace unimapper::simulator {
namespace {

template <typename Motion>
std::unique_ptr<Scene> make_drive(const Visit& visit) {
  const auto simulate = [&](const TownPlan& plan, const RobotMotion& robot) {
    return Traffic(plan, robot, visit.seed, visit.day, visit.duration_s).take();
  };
  return std::make_unique<ActorScene<Town, Motion>>(visit, build_town, simulate);
}

}  // namespace

std::unique_ptr<Scene> make_town_scene(const Visit& visit) {
  return make_drive<RobotMotion>(visit);
}

std::unique_ptr<Scene> make_convoy_scene(const Visit& visit) {
  return make_drive<StopAndGoMotion>(visit);
}

}  // namespace unimapper::simulator
