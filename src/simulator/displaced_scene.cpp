#include "displaced_scene.hpp"

#include <utility>

namespace unimapper::simulator {

DisplacedScene::DisplacedScene(std::unique_ptr<Scene> scene, const Frame& T_world_scene)
    : scene_(std::move(scene)), T_world_scene_(T_world_scene), world_(scene_->world()) {
  std::vector<float>& p = world_.mesh.positions;
  for (std::size_t i = 0; i + 2 < p.size(); i += 3) {
    const Vec3 at = T_world_scene_({p[i], p[i + 1], p[i + 2]});
    p[i] = static_cast<float>(at.x);
    p[i + 1] = static_cast<float>(at.y);
    p[i + 2] = static_cast<float>(at.z);
  }
  for (Instance& instance : world_.instances) instance.frame = T_world_scene_ * instance.frame;
}

Frame DisplacedScene::sensor_frame(double time_s) const {
  Frame sensor = T_world_scene_ * scene_->sensor_frame(time_s);
  sensor.y = cross(sensor.z, sensor.x);
  return sensor;
}

std::vector<MovingInstance> DisplacedScene::during(double begin_s, double end_s,
                                                   Vec2 around) const {
  const Vec3 inside = T_world_scene_.inverse()({around.x, around.y, T_world_scene_.origin.z});
  std::vector<MovingInstance> instances = scene_->during(begin_s, end_s, {inside.x, inside.y});
  for (MovingInstance& instance : instances) {
    instance.begin = T_world_scene_ * instance.begin;
    instance.end = T_world_scene_ * instance.end;
  }
  return instances;
}

}  // namespace unimapper::simulator
