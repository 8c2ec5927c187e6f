// Town scene: a car with a sensor mast in traffic.
#include "random.hpp"
#include "robot_motion.hpp"
#include "scene.hpp"
#include "town.hpp"
#include "traffic.hpp"

namespace unimapper::simulator {
namespace {

class TownScene : public Scene {
 public:
  explicit TownScene(const Visit& visit)
      : town_(build_town(visit.seed, visit.day)),
        robot_(town_.plan, visit.route, derive_key(visit.seed, visit.day), visit.duration_s),
        actors_(town_.prototypes, town_.plan,
                Traffic(town_.plan, robot_, visit.seed, visit.day, visit.duration_s).take()) {}

  [[nodiscard]] const World& world() const override { return town_; }
  [[nodiscard]] Frame sensor_frame(double time_s) const override {
    return robot_.sensor_frame(time_s);
  }
  [[nodiscard]] std::vector<MovingInstance> during(double begin_s, double end_s,
                                                   Vec2 around) const override {
    return actors_.during(begin_s, end_s, around);
  }

 private:
  Town town_;
  RobotMotion robot_;
  Actors actors_;
};

}  // namespace

std::unique_ptr<Scene> make_town_scene(const Visit& visit) {
  return std::make_unique<TownScene>(visit);
}

}  // namespace unimapper::simulator
