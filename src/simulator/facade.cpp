#include "facade.hpp"

namespace unimapper::simulator {

void add_cell_with_opening(const Wall& wall, double x0, double z0, double x1, double z1,
                           const Opening& o) {
  wall.rectangle(x0, z0, x1, o.z0, 0.0, wall.surface);
  wall.rectangle(x0, o.z1, x1, z1, 0.0, wall.surface);
  wall.rectangle(x0, o.z0, o.x0, o.z1, 0.0, wall.surface);
  wall.rectangle(o.x1, o.z0, x1, o.z1, 0.0, wall.surface);
  const Vec3 corners[4] = {{o.x0, 0, o.z0}, {o.x1, 0, o.z0}, {o.x1, 0, o.z1}, {o.x0, 0, o.z1}};
  for (int i = 0; i < 4; ++i) {
    const Vec3 a = corners[i];
    const Vec3 b = corners[(i + 1) % 4];
    wall.mesh.quad(wall.frame(a), wall.frame(b), wall.frame(b + Vec3{0, o.recess, 0}),
                   wall.frame(a + Vec3{0, o.recess, 0}), wall.surface);
  }
}

void add_window(const Wall& wall, const Opening& o, bool has_cross_bar, bool has_sill) {
  wall.rectangle(o.x0, o.z0, o.x1, o.z1, o.recess, Surface::kGlass);
  constexpr double kBar = 0.045;
  const double y0 = o.recess - 0.03;
  const double y1 = o.recess + 0.03;
  wall.box({o.x0, y0, o.z0}, {o.x1, y1, o.z0 + 2 * kBar}, Surface::kWindowFrame);
  wall.box({o.x0, y0, o.z1 - 2 * kBar}, {o.x1, y1, o.z1}, Surface::kWindowFrame);
  if (has_cross_bar) {
    const double middle = 0.5 * (o.x0 + o.x1);
    wall.box({middle - kBar, y0, o.z0}, {middle + kBar, y1, o.z1}, Surface::kWindowFrame);
  }
  if (has_sill) {
    wall.box({o.x0 - 0.06, -0.09, o.z0 - 0.06}, {o.x1 + 0.06, 0.02, o.z0}, Surface::kConcrete);
  }
}

}  // namespace unimapper::simulator
