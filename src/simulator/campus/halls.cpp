// Campus buildings: window bands, arcades, overhangs, a passage and a footbridge.
#include <algorithm>

#include "campus.hpp"
#include "src/simulator/facade.hpp"
#include "src/simulator/random.hpp"

namespace unimapper::simulator::campus {
namespace {

constexpr double kStorey = 3.9;
constexpr double kFoundation = 3.5;  // down into the slope

/// Part of a wall along it.
struct Range {
  double from, to;
};

struct Style {
  Surface wall;
  double bay, window_share, sill, window_height, recess;
};

/// A hall in its own frame: x along the front, y into the hall, z up from its ground floor.
struct Building {
  Mesh& mesh;
  const Hall& hall;
  Frame frame;
  double width, depth;
  Style style;

  [[nodiscard]] double height() const { return hall.storeys * kStorey; }
  [[nodiscard]] bool has_passage() const { return hall.passage_to > hall.passage_from; }

  /// Wall from `corner` towards `along`; the inside lies to its left.
  [[nodiscard]] Wall wall(Vec3 corner, Vec3 along) const {
    Frame local;
    local.x = along;
    local.y = cross({0, 0, 1}, along);
    local.origin = corner;
    return {mesh, frame * local, style.wall};
  }
};

/// Front left corner and direction of the front, seen from before it.
Frame hall_frame(const Plan& plan, const Hall& hall) {
  const Area& a = hall.area;
  Vec2 corner = a.low;
  Vec2 along{1, 0};
  if (hall.front == Side::kEast) {
    corner = {a.high.x, a.low.y};
    along = {0, 1};
  } else if (hall.front == Side::kNorth) {
    corner = a.high;
    along = {-1, 0};
  } else if (hall.front == Side::kWest) {
    corner = {a.low.x, a.high.y};
    along = {0, -1};
  }
  double floor = -1e9;
  for (const double x : {a.low.x, a.centre().x, a.high.x}) {
    for (const double y : {a.low.y, a.centre().y, a.high.y}) {
      floor = std::max(floor, plan.height({x, y}));
    }
  }
  const Vec2 middle = a.centre();
  Frame turned = rotation_frame({0, 0, hall.turn});
  turned.origin = {middle.x, middle.y, floor + 0.05};
  return turned * upright_frame({corner.x - middle.x, corner.y - middle.y, 0}, along);
}

void add_entrance(const Wall& wall, double x0, double x1) {
  const double middle = 0.5 * (x0 + x1);
  const Opening door{middle - 1.0, 0.02, middle + 1.0, 2.5, 0.3};
  add_cell_with_opening(wall, x0, 0.0, x1, kStorey, door);
  wall.rectangle(door.x0, door.z0, door.x1, door.z1, door.recess, Surface::kDoor);
}

/// One storey of windows; the ground floor has an entrance in the middle bay if asked for.
void add_bays(const Wall& wall, const Style& style, Range range, int storey, bool has_entrance) {
  const int bays = std::max(1, static_cast<int>((range.to - range.from) / style.bay));
  const double bay = (range.to - range.from) / bays;
  const double z0 = storey * kStorey;
  for (int i = 0; i < bays; ++i) {
    const double x0 = range.from + i * bay;
    if (has_entrance && i == bays / 2) {
      add_entrance(wall, x0, x0 + bay);
      continue;
    }
    const double margin = 0.5 * bay * (1.0 - style.window_share);
    const Opening window{x0 + margin, z0 + style.sill, x0 + bay - margin,
                         z0 + style.sill + style.window_height, style.recess};
    add_cell_with_opening(wall, x0, z0, x0 + bay, z0 + kStorey, window);
    add_window(wall, window, true, storey > 0);
  }
}

/// Ground floor and foundation of one side, upper floors above it.
void add_side(const Building& b, const Wall& upper, double length, const Wall& lower,
              const std::vector<Range>& ground_floor, bool has_entrance) {
  for (const Range& range : ground_floor) {
    add_bays(lower, b.style, range, 0, has_entrance);
    lower.rectangle(range.from, -kFoundation, range.to, 0.0, 0.0, Surface::kConcrete);
    lower.box({range.from, -0.05, -kFoundation}, {range.to, 0.0, 0.0}, Surface::kConcrete);
  }
  for (int storey = 1; storey < b.hall.storeys; ++storey) {
    add_bays(upper, b.style, {0.0, length}, storey, false);
    upper.box({0.0, -0.08, storey * kStorey - 0.12}, {length, 0.0, storey * kStorey + 0.12},
              Surface::kConcrete);
  }
}

void add_walls(const Building& b) {
  const double w = b.width;
  const double d = b.depth;
  const double recess = b.hall.recess;
  std::vector<Range> front{{0.0, w}};
  std::vector<Range> back{{0.0, w}};
  if (b.has_passage()) {
    front = {{0.0, b.hall.passage_from}, {b.hall.passage_to, w}};
    back = {{0.0, w - b.hall.passage_to}, {w - b.hall.passage_from, w}};
  }
  const Wall front_wall = b.wall({0, 0, 0}, {1, 0, 0});
  add_side(b, front_wall, w, b.wall({0, recess, 0}, {1, 0, 0}), front, true);
  const Wall right = b.wall({w, 0, 0}, {0, 1, 0});
  add_side(b, right, d, right, {{recess, d}}, false);
  const Wall rear = b.wall({w, d, 0}, {-1, 0, 0});
  add_side(b, rear, w, rear, back, false);
  const Wall left = b.wall({0, d, 0}, {0, -1, 0});
  add_side(b, left, d, left, {{0.0, d - recess}}, false);
}

/// Ceiling below the overhanging floors, and the columns of an arcade.
void add_recess(const Building& b) {
  const double r = b.hall.recess;
  if (r <= 0.0) return;
  b.mesh.box(b.frame, {0, 0, kStorey - 0.15}, {b.width, r + 0.1, kStorey}, Surface::kConcrete);
  if (!b.hall.has_columns) return;
  constexpr double kSpacing = 4.2;
  const int count = std::max(1, static_cast<int>(b.width / kSpacing));
  for (int i = 0; i <= count; ++i) {
    const double x = 0.3 + (b.width - 0.6) * i / count;
    b.mesh.tube(b.frame({x, 0.35, -kFoundation}), b.frame({x, 0.35, kStorey - 0.1}), 0.24, 0.22, 10,
                Surface::kConcrete);
  }
}

void add_passage(const Building& b) {
  if (!b.has_passage()) return;
  for (const double x : {b.hall.passage_from, b.hall.passage_to}) {
    b.mesh.quad(b.frame({x, 0, -kFoundation}), b.frame({x, b.depth, -kFoundation}),
                b.frame({x, b.depth, kStorey}), b.frame({x, 0, kStorey}), Surface::kBrick);
    // Pilasters structure the long wall.
    const double out = x == b.hall.passage_from ? 0.12 : -0.12;
    for (double y = 1.5; y < b.depth - 1.0; y += 3.0) {
      b.mesh.box(b.frame, {std::min(x, x + out), y, -kFoundation},
                 {std::max(x, x + out), y + 0.4, kStorey}, Surface::kConcrete);
    }
  }
  b.mesh.box(b.frame, {b.hall.passage_from, 0.0, kStorey - 0.2},
             {b.hall.passage_to, b.depth, kStorey}, Surface::kConcrete);
}

/// Floors, and cores three metres behind the windows: targets of rays through panes.
void add_rooms(const Building& b) {
  constexpr double kInset = 3.0;
  const auto rooms = [&](double x0, double x1, double y0, double z0, double z1) {
    b.mesh.quad(b.frame({x0, y0, z0}), b.frame({x1, y0, z0}), b.frame({x1, b.depth, z0}),
                b.frame({x0, b.depth, z0}), Surface::kInterior);
    if (x1 - x0 < 2.5 * kInset) return;
    b.mesh.box(b.frame, {x0 + kInset, y0 + kInset, z0}, {x1 - kInset, b.depth - kInset, z1},
               Surface::kInterior);
  };
  const double gap = 0.05;
  if (b.has_passage()) {
    rooms(gap, b.hall.passage_from - gap, gap, 0.0, kStorey);
    rooms(b.hall.passage_to + gap, b.width - gap, gap, 0.0, kStorey);
  } else {
    rooms(gap, b.width - gap, b.hall.recess + gap, 0.0, kStorey);
  }
  for (int storey = 1; storey < b.hall.storeys; ++storey) {
    rooms(gap, b.width - gap, gap, storey * kStorey, (storey + 1) * kStorey);
  }
}

void add_roof(const Building& b, Random& random) {
  constexpr double kThick = 0.3;
  const double z = b.height();
  const double w = b.width;
  const double d = b.depth;
  b.mesh.quad(b.frame({0, 0, z + 0.05}), b.frame({w, 0, z + 0.05}), b.frame({w, d, z + 0.05}),
              b.frame({0, d, z + 0.05}), Surface::kRoof);
  b.mesh.box(b.frame, {0, 0, z}, {w, kThick, z + 0.8}, b.style.wall);
  b.mesh.box(b.frame, {0, d - kThick, z}, {w, d, z + 0.8}, b.style.wall);
  b.mesh.box(b.frame, {0, 0, z}, {kThick, d, z + 0.8}, b.style.wall);
  b.mesh.box(b.frame, {w - kThick, 0, z}, {w, d, z + 0.8}, b.style.wall);
  const double x = random.uniform(0.2, 0.6) * w;
  b.mesh.box(b.frame, {x, 0.35 * d, z}, {x + 5.0, 0.65 * d, z + 2.6}, Surface::kRail);
}

/// A canopy over the entrance of a flush front.
void add_awning(const Building& b) {
  if (b.hall.recess > 0.0) return;
  const double end = b.has_passage() ? b.hall.passage_from : b.width;
  const int bays = std::max(1, static_cast<int>(end / b.style.bay));
  const double middle = end / bays * (bays / 2 + 0.5);
  b.mesh.box(b.frame, {middle - 2.2, -1.9, 2.85}, {middle + 2.2, 0.0, 3.0}, Surface::kRail);
  for (const double side : {-2.0, 2.0}) {
    b.mesh.tube(b.frame({middle + side, -1.75, -1.0}), b.frame({middle + side, -1.75, 2.9}), 0.05,
                0.05, 6, Surface::kPoleMetal);
  }
}

Frame add_hall(const Plan& plan, const Hall& hall, Mesh& mesh, Random& random) {
  static constexpr Surface kWalls[] = {Surface::kBrick, Surface::kPlaster, Surface::kConcrete};
  const bool runs_along_x = hall.front == Side::kSouth || hall.front == Side::kNorth;
  const Vec2 size = hall.area.high - hall.area.low;
  const Style style{kWalls[random.index(3)],  random.uniform(2.6, 4.0), random.uniform(0.55, 0.8),
                    random.uniform(0.5, 0.9), random.uniform(1.7, 2.4), random.uniform(0.12, 0.3)};
  const Building b{mesh,
                   hall,
                   hall_frame(plan, hall),
                   runs_along_x ? size.x : size.y,
                   runs_along_x ? size.y : size.x,
                   style};
  add_walls(b);
  add_recess(b);
  add_passage(b);
  add_rooms(b);
  add_roof(b, random);
  add_awning(b);
  return b.frame;
}

/// A glazed footbridge; its floor is `floor` high.
void add_bridge(const Plan& plan, Mesh& mesh, double floor) {
  const Area& a = plan.bridge();
  const Frame frame = upright_frame({a.low.x, a.low.y, floor}, {1, 0});
  const Vec2 size = a.high - a.low;
  mesh.box(frame, {0, 0, -0.4}, {size.x, size.y, 0.0}, Surface::kConcrete);
  mesh.box(frame, {0, 0, 2.8}, {size.x, size.y, 3.1}, Surface::kConcrete);
  for (const double y : {0.1, size.y - 0.1}) {
    mesh.quad(frame({0, y, 0}), frame({size.x, y, 0}), frame({size.x, y, 2.8}), frame({0, y, 2.8}),
              Surface::kGlass);
    for (double x = 0.0; x < size.x; x += 1.5) {
      mesh.box(frame, {x, y - 0.05, 0.0}, {x + 0.08, y + 0.05, 2.8}, Surface::kWindowFrame);
    }
  }
}

}  // namespace

void add_halls(std::uint64_t seed, Campus& campus) {
  double bridge_floor = -1e9;
  std::uint64_t index = 0;
  for (const Hall& hall : campus.plan.halls()) {
    Random random(seed, Stream::kBlock, 2, index);
    const Frame frame = add_hall(campus.plan, hall, campus.mesh, random);
    // The bridge joins the halls 1 and 2.
    if (index == 1 || index == 2) bridge_floor = std::max(bridge_floor, frame.origin.z + kStorey);
    ++index;
  }
  add_bridge(campus.plan, campus.mesh, bridge_floor + 0.4);
}

}  // namespace unimapper::simulator::campus
