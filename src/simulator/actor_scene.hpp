// Scene of a static model, a robot and actors around it.
#pragma once

#include "actors.hpp"
#include "random.hpp"
#include "scene.hpp"

namespace unimapper::simulator {

/// `Model` is a World with a plan and prototypes, `Robot` drives or walks through the plan.
template <typename Model, typename Robot>
class ActorScene : public Scene {
 public:
  /// `build(seed, day)` makes the model, `simulate(plan, robot)` the actors.
  template <typename Build, typename Simulate>
  ActorScene(const Visit& visit, const Build& build, const Simulate& simulate)
      : model_(build(visit.seed, visit.day)),
        robot_(model_.plan, visit.route, derive_key(visit.seed, visit.day), visit.duration_s),
        actors_(model_.prototypes, model_.plan, simulate(model_.plan, robot_)) {}

  [[nodiscard]] const World& world() const override { return model_; }
  [[nodiscard]] Frame sensor_frame(double time_s) const override {
    return robot_.sensor_frame(time_s);
  }
  [[nodiscard]] std::vector<MovingInstance> during(double begin_s, double end_s,
                                                   Vec2 around) const override {
    return actors_.during(begin_s, end_s, around);
  }
  [[nodiscard]] std::vector<ObjectMotion> motions(
      const std::vector<double>& stamps_s) const override {
    return actors_.motions(stamps_s);
  }

 private:
  Model model_;
  Robot robot_;
  Actors actors_;
};

}  // namespace unimapper::simulator
