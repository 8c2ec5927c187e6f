// House model: walls, windows, doors, balconies, rooms and roof.
#include <algorithm>

#include "facade.hpp"
#include "random.hpp"
#include "world.hpp"

namespace unimapper::simulator {
namespace {

void add_door(const Wall& wall, const Opening& o, double ground_drop) {
  wall.rectangle(o.x0, o.z0, o.x1, o.z1, o.recess, Surface::kDoor);
  constexpr double kRise = 0.17;
  constexpr double kTread = 0.29;
  const double drop = o.z0 + ground_drop;
  const int steps = std::clamp(static_cast<int>(drop / kRise), 0, 9);
  for (int i = 0; i < steps; ++i) {
    const double reach = 0.5 + kTread * i;
    wall.box({o.x0 - 0.25, -reach, -ground_drop - 0.5}, {o.x1 + 0.25, 0.0, o.z0 - kRise * i},
             Surface::kConcrete);
  }
  wall.box({o.x0 - 0.3, -0.9, o.z1 + 0.15}, {o.x1 + 0.3, 0.0, o.z1 + 0.24}, Surface::kConcrete);
}

void add_balcony(const Wall& wall, double x0, double x1, double floor) {
  constexpr double kDepth = 1.25;
  wall.box({x0, -kDepth, floor - 0.16}, {x1, 0.0, floor}, Surface::kConcrete);
  wall.box({x0, -kDepth, floor + 1.0}, {x1, -kDepth + 0.05, floor + 1.06}, Surface::kRail);
  const int bars = std::max(3, static_cast<int>((x1 - x0) / 0.14));
  for (int i = 0; i <= bars; ++i) {
    const double x = x0 + (x1 - x0) * i / bars;
    wall.rectangle(x - 0.012, floor, x + 0.012, floor + 1.0, -kDepth + 0.025, Surface::kRail);
  }
  for (const double x : {x0, x1}) {
    wall.mesh.quad(wall.frame({x, -kDepth, floor + 0.1}), wall.frame({x, 0, floor + 0.1}),
                   wall.frame({x, 0, floor + 1.0}), wall.frame({x, -kDepth, floor + 1.0}),
                   Surface::kRail);
  }
}

/// How the openings of one house are laid out; the same for all its storeys.
struct FacadeStyle {
  double bay_width, window_share, window_height, recess;
  bool cross_bars, sills;
};

struct WallRole {
  bool is_front;
  bool has_shop;
  double storey_height;
  int storeys;
  double ground_drop;
};

void add_wall(const Wall& wall, double width, const WallRole& role, const FacadeStyle& style,
              Random& random) {
  const int bays = std::max(1, static_cast<int>(width / style.bay_width));
  const double bay = width / bays;
  const int door_bay =
      role.is_front ? static_cast<int>(random.index(static_cast<std::uint32_t>(bays))) : -1;
  const bool balconies = role.is_front && role.storeys > 1 && random.chance(0.4);
  const std::uint32_t balcony_phase = random.index(2);
  for (int storey = 0; storey < role.storeys; ++storey) {
    const double z0 = storey * role.storey_height;
    const double z1 = z0 + role.storey_height;
    for (int b = 0; b < bays; ++b) {
      const double x0 = b * bay;
      const double x1 = x0 + bay;
      const bool is_blank = !role.is_front && random.chance(0.45);
      if (is_blank) {
        wall.rectangle(x0, z0, x1, z1, 0.0, wall.surface);
        continue;
      }
      if (storey == 0 && b == door_bay) {
        const double middle = 0.5 * (x0 + x1);
        const Opening door{middle - 0.55, z0 + 0.05, middle + 0.55, z0 + 2.2, 0.28};
        add_cell_with_opening(wall, x0, z0, x1, z1, door);
        add_door(wall, door, role.ground_drop);
        continue;
      }
      const bool is_shop = storey == 0 && role.has_shop && role.is_front;
      const double half = 0.5 * bay * (is_shop ? 0.86 : style.window_share);
      const double sill = is_shop ? 0.35 : 0.9;
      const double top = is_shop ? role.storey_height - 0.45 : sill + style.window_height;
      const double middle = 0.5 * (x0 + x1);
      const Opening window{middle - half, z0 + sill, middle + half,
                           z0 + std::min(top, role.storey_height - 0.2), style.recess};
      add_cell_with_opening(wall, x0, z0, x1, z1, window);
      add_window(wall, window, style.cross_bars, style.sills && !is_shop);
      if (balconies && storey > 0 && static_cast<std::uint32_t>(b) % 2 == balcony_phase) {
        add_balcony(wall, x0 + 0.12, x1 - 0.12, z0 + 0.02);
      } else if (storey > 0 && random.chance(0.05)) {
        wall.box({x1 - 0.2 - 0.8, -0.32, z0 + 0.15}, {x1 - 0.2, -0.03, z0 + 0.7}, Surface::kRail);
      }
    }
  }
  wall.rectangle(0.0, -3.5, width, 0.0, 0.0, Surface::kConcrete);  // down into the slope
  if (role.is_front) {
    const double x = random.chance(0.5) ? 0.12 : width - 0.12;
    const double height = role.storeys * role.storey_height;
    wall.mesh.tube(wall.frame({x, -0.08, -1.0}), wall.frame({x, -0.08, height}), 0.05, 0.05, 6,
                   Surface::kRail);
    // A plinth and a cornice keep the front from being one plane.
    wall.box({0.0, -0.06, -3.5}, {width, 0.0, -0.02}, Surface::kConcrete);
    if (random.chance(0.6)) {
      const double z = role.storey_height - 0.12;
      wall.box({0.0, -0.12, z}, {width, 0.0, z + 0.14}, Surface::kConcrete);
    }
  }
}

/// Floors and a core three metres behind the walls: targets of rays through windows.
void add_rooms(Mesh& mesh, const Frame& frame, const HouseShape& shape) {
  for (int storey = 0; storey <= shape.storeys; ++storey) {
    const double z = storey * shape.storey_height;
    mesh.quad(frame({0.02, 0.02, z}), frame({shape.width - 0.02, 0.02, z}),
              frame({shape.width - 0.02, shape.depth - 0.02, z}),
              frame({0.02, shape.depth - 0.02, z}), Surface::kInterior);
  }
  const double inset = std::min({3.0, 0.35 * shape.width, 0.35 * shape.depth});
  mesh.box(frame, {inset, inset, 0.0},
           {shape.width - inset, shape.depth - inset, shape.storeys * shape.storey_height},
           Surface::kInterior);
}

void add_gable_roof(Mesh& mesh, const Frame& frame, const HouseShape& shape, Surface wall) {
  constexpr double kEaves = 0.45;
  const double z = shape.storeys * shape.storey_height;
  const double ridge = z + 0.36 * shape.depth;
  const double low = z - 0.72 * kEaves;
  const double x0 = -0.3;
  const double x1 = shape.width + 0.3;
  const double middle = 0.5 * shape.depth;
  for (const double lift : {0.0, 0.14}) {
    mesh.quad(frame({x0, -kEaves, low + lift}), frame({x1, -kEaves, low + lift}),
              frame({x1, middle, ridge + lift}), frame({x0, middle, ridge + lift}), Surface::kRoof);
    mesh.quad(frame({x0, shape.depth + kEaves, low + lift}),
              frame({x1, shape.depth + kEaves, low + lift}), frame({x1, middle, ridge + lift}),
              frame({x0, middle, ridge + lift}), Surface::kRoof);
  }
  for (const double x : {0.0, shape.width}) {
    mesh.triangle(frame({x, 0, z}), frame({x, shape.depth, z}), frame({x, middle, ridge}), wall);
  }
  mesh.tube(frame({x0, -kEaves - 0.05, low + 0.02}), frame({x1, -kEaves - 0.05, low + 0.02}), 0.07,
            0.07, 6, Surface::kRail);
  mesh.box(frame, {0.3 * shape.width, 0.6 * shape.depth, z},
           {0.3 * shape.width + 0.7, 0.6 * shape.depth + 0.7, ridge + 0.8}, Surface::kBrick);
}

void add_flat_roof(Mesh& mesh, const Frame& frame, const HouseShape& shape, Surface wall,
                   Random& random) {
  const double z = shape.storeys * shape.storey_height;
  constexpr double kThick = 0.25;
  const double w = shape.width;
  const double d = shape.depth;
  mesh.box(frame, {0, 0, z}, {w, kThick, z + 0.7}, wall);
  mesh.box(frame, {0, d - kThick, z}, {w, d, z + 0.7}, wall);
  mesh.box(frame, {0, 0, z}, {kThick, d, z + 0.7}, wall);
  mesh.box(frame, {w - kThick, 0, z}, {w, d, z + 0.7}, wall);
  mesh.quad(frame({0, 0, z + 0.05}), frame({w, 0, z + 0.05}), frame({w, d, z + 0.05}),
            frame({0, d, z + 0.05}), Surface::kRoof);
  if (random.chance(0.5)) {
    const double x = random.uniform(0.2, 0.6) * w;
    mesh.box(frame, {x, 0.4 * d, z}, {x + 2.5, 0.4 * d + 2.5, z + 2.4}, wall);
  }
}

}  // namespace

void add_house(Mesh& mesh, const Frame& frame, const HouseShape& shape, Random& random) {
  static constexpr Surface kWalls[] = {Surface::kBrick, Surface::kPlaster, Surface::kPlaster,
                                       Surface::kConcrete};
  const Surface surface = kWalls[random.index(4)];
  const FacadeStyle style{random.uniform(2.3, 3.6),   random.uniform(0.4, 0.6),
                          random.uniform(1.25, 1.75), random.uniform(0.1, 0.28),
                          random.chance(0.6),         random.chance(0.7)};
  const double w = shape.width;
  const double d = shape.depth;
  struct Side {
    Vec3 corner, along;
    double length;
    bool is_front;
  };
  const Side sides[4] = {{{0, 0, 0}, {1, 0, 0}, w, true},
                         {{w, 0, 0}, {0, 1, 0}, d, false},
                         {{w, d, 0}, {-1, 0, 0}, w, false},
                         {{0, d, 0}, {0, -1, 0}, d, false}};
  for (const Side& side : sides) {
    Frame local;
    local.x = side.along;
    local.y = cross({0, 0, 1}, side.along);
    local.origin = side.corner;
    const Wall wall{mesh, frame * local, surface};
    add_wall(wall, side.length,
             {side.is_front, shape.has_shop, shape.storey_height, shape.storeys, shape.ground_drop},
             style, random);
  }
  add_rooms(mesh, frame, shape);
  const bool is_gabled = shape.storeys <= 3 && random.chance(0.7);
  if (is_gabled) {
    add_gable_roof(mesh, frame, shape, surface);
  } else {
    add_flat_roof(mesh, frame, shape, surface, random);
  }
}

}  // namespace unimapper::simulator
