// Campus scene: a small robot among pedestrians.
#include "campus.hpp"
#include "crowd.hpp"
#include "src/simulator/random.hpp"
#include "src/simulator/scene.hpp"

namespace unimapper::simulator {
namespace campus {
namespace {

class CampusScene : public Scene {
 public:
  explicit CampusScene(const Visit& visit)
      : campus_(build_campus(visit.seed, visit.day)),
        robot_(campus_.plan, visit.route, derive_key(visit.seed, visit.day), visit.duration_s),
        actors_(campus_.prototypes, campus_.plan,
                simulate_crowd(campus_.plan, robot_, visit.seed, visit.day, visit.duration_s)) {}

  [[nodiscard]] const World& world() const override { return campus_; }
  [[nodiscard]] Frame sensor_frame(double time_s) const override {
    return robot_.sensor_frame(time_s);
  }
  [[nodiscard]] std::vector<MovingInstance> during(double begin_s, double end_s,
                                                   Vec2 around) const override {
    return actors_.during(begin_s, end_s, around);
  }

 private:
  Campus campus_;
  RobotWalk robot_;
  Actors actors_;
};

}  // namespace
}  // namespace campus

std::unique_ptr<Scene> make_campus_scene(const Visit& visit) {
  return std::make_unique<campus::CampusScene>(visit);
}

}  // namespace unimapper::simulator
