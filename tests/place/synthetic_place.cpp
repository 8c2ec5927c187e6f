#include "synthetic_place.hpp"

#include <cmath>
#include <map>

#include "src/core/voxel_key.hpp"

namespace unimapper::test {

namespace {

void add_block(std::vector<Surface>& surfaces, const Eigen::Vector2d& center, double yaw,
               double length, double width, double height) {
  const Eigen::Vector3d u(std::cos(yaw) * length, std::sin(yaw) * length, 0.0);
  const Eigen::Vector3d v(-std::sin(yaw) * width, std::cos(yaw) * width, 0.0);
  const Eigen::Vector3d corner(center.x() - 0.5 * (u.x() + v.x()),
                               center.y() - 0.5 * (u.y() + v.y()), 0.0);
  const Eigen::Vector3d up(0.0, 0.0, height);
  surfaces.push_back({corner, u, up, false});
  surfaces.push_back({corner + v, u, up, false});
  surfaces.push_back({corner, v, up, false});
  surfaces.push_back({corner + u, v, up, false});
}

}  // namespace

std::vector<Surface> make_scene(std::uint64_t seed) {
  Random random(seed);
  std::vector<Surface> surfaces;
  surfaces.push_back({{-70, -70, 0}, {140, 0, 0}, {0, 140, 0}, true});
  for (int i = 0; i < 16; ++i) {
    const double bearing = random.uniform(0.0, 6.28);
    const double distance = random.uniform(12.0, 45.0);
    const Eigen::Vector2d center(distance * std::cos(bearing), distance * std::sin(bearing));
    const double yaw = random.uniform(0.0, 1.57);
    const double length = random.uniform(4.0, 14.0);
    const double width = random.uniform(3.0, 8.0);
    add_block(surfaces, center, yaw, length, width, random.uniform(2.5, 8.0));
  }
  for (int i = 0; i < 24; ++i) {
    const double bearing = random.uniform(0.0, 6.28);
    const double distance = random.uniform(6.0, 45.0);
    const Eigen::Vector2d center(distance * std::cos(bearing), distance * std::sin(bearing));
    add_block(surfaces, center, 0.0, 0.25, 0.25, random.uniform(2.0, 6.0));
  }
  return surfaces;
}

std::vector<Surface> mirrored(std::vector<Surface> surfaces) {
  for (Surface& surface : surfaces) {
    for (Eigen::Vector3d* v : {&surface.corner, &surface.along, &surface.up}) v->x() = -v->x();
  }
  return surfaces;
}

std::vector<Surface> moved(std::vector<Surface> surfaces, const Pose& T_new_old) {
  for (Surface& surface : surfaces) {
    surface.corner = T_new_old * surface.corner;
    surface.along = T_new_old.rotation * surface.along;
    surface.up = T_new_old.rotation * surface.up;
  }
  return surfaces;
}

std::vector<FineCell> observe(const std::vector<Surface>& surfaces, const Pose& T_world_sensor,
                              const View& view) {
  struct Sum {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    int points = 0;
    bool ground = false;
  };
  Random random(view.noise_seed);
  std::map<std::uint64_t, Sum> cells;
  const Pose T_level_world = level_frame(T_world_sensor).inverse();
  for (const Surface& surface : surfaces) {
    // A flat gaze leaves few points on the ground.
    const double spacing = surface.ground ? 5.0 * view.spacing_m : view.spacing_m;
    const int columns = std::max(1, static_cast<int>(surface.along.norm() / spacing));
    const int rows = std::max(1, static_cast<int>(surface.up.norm() / spacing));
    for (int i = 0; i < columns; ++i) {
      for (int j = 0; j < rows; ++j) {
        const double a = (i + random.uniform()) / columns;
        const double b = (j + random.uniform()) / rows;
        // One by one: compilers for different processors evaluate arguments in different orders.
        const double noise_z = random.uniform(-1, 1);
        const double noise_y = random.uniform(-1, 1);
        const double noise_x = random.uniform(-1, 1);
        const Eigen::Vector3d noise(noise_x, noise_y, noise_z);
        const Eigen::Vector3d p =
            surface.corner + a * surface.along + b * surface.up + view.noise_m * noise;
        if ((p - T_world_sensor.translation).norm() > view.range_m) continue;
        // Cells lie in the world's grid, far from its origin or not.
        const Eigen::Vector3d q = (p + view.grid_shift - T_world_sensor.translation) * 5.0;
        const VoxelIndex index{static_cast<std::int32_t>(std::floor(q.x())),
                               static_cast<std::int32_t>(std::floor(q.y())),
                               static_cast<std::int32_t>(std::floor(q.z()))};
        Sum& sum = cells[pack(index)];
        sum.position += T_level_world * p;
        ++sum.points;
        sum.ground = sum.ground || (surface.ground && view.mark_ground);
      }
    }
  }
  std::vector<FineCell> result;
  for (const auto& [key, sum] : cells) {
    FineCell cell{};
    cell.position = (sum.position / sum.points).cast<float>();
    cell.points = static_cast<std::uint16_t>(std::min(sum.points, 65535));
    cell.ground = sum.ground ? 1 : 0;
    result.push_back(cell);
  }
  return result;
}

Pose standing_at(double x, double y, double height, double yaw_rad) {
  return {Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix(), {x, y, height}};
}

}  // namespace unimapper::test
