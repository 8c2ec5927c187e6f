// Scene at another place of the world: a copy that a LiDAR cannot tell from the original
#pragma once

#include <memory>

#include "scene.hpp"

namespace unimapper::simulator {

/// Days of the copy; what is parked there has nothing to do with the original's habits.
inline constexpr std::uint32_t kDaysOfCopy = 1U << 31U;

/// Geometry, robot and actors of `scene`, displaced by `T_world_scene`. A left-handed one mirrors
/// them; the robot then drives the mirrored way, its sensor stays right-handed.
class DisplacedScene : public Scene {
 public:
  DisplacedScene(std::unique_ptr<Scene> scene, const Frame& T_world_scene);

  [[nodiscard]] const World& world() const override { return world_; }
  [[nodiscard]] Frame sensor_frame(double time_s) const override;
  [[nodiscard]] std::vector<MovingInstance> during(double begin_s, double end_s,
                                                   Vec2 around) const override;
  [[nodiscard]] std::vector<ObjectMotion> motions(
      const std::vector<double>& stamps_s) const override {
    return scene_->motions(stamps_s);
  }
  [[nodiscard]] const Frame& T_world_scene() const { return T_world_scene_; }

 private:
  std::unique_ptr<Scene> scene_;
  Frame T_world_scene_;
  World world_;
};

/// Routes A and B of the scene that `make(visit)` makes; C is B in a copy at `T_world_copy`, with
/// other cars and people. The place is closed all around, so that neither is seen from the other
/// and each visit's world holds only its own.
template <typename Make>
std::unique_ptr<Scene> make_original_or_copy(Visit visit, const Frame& T_world_copy,
                                             const Make& make) {
  if (visit.route != 'C') return make(visit);
  visit.route = 'B';
  visit.day |= kDaysOfCopy;
  return std::make_unique<DisplacedScene>(make(visit), T_world_copy);
}

}  // namespace unimapper::simulator
