// Hall: one large room with shelves, columns and tables, small enough to see all of it.
#include "src/simulator/sites/site_scene.hpp"
#include "src/simulator/strolling.hpp"

namespace unimapper::simulator::sites::hall {
namespace {

struct Size {
  double half_length, half_width, height;
};

Size size_of(std::uint64_t seed) {
  Random random(seed, Stream::kPlan, 7);
  return {random.uniform(14.0, 20.0), random.uniform(9.0, 12.0), random.uniform(4.5, 7.5)};
}

void make_plan(std::uint64_t seed, Plan& plan) {
  const Size size = size_of(seed);
  const double x = size.half_length - 3.0;
  const double y = size.half_width - 3.0;
  const Path loop = rounded_loop({{-x, -y}, {x, -y}, {x, y}, {-x, y}});
  plan.set_tours(loop, 3.0, 10.0, loop.length() - 20.0);
  plan.robot = {1.0, 0.8, 0.7, 0.3, 1.8, 25.0};
  Random random(seed, Stream::kPedestrian, 7);
  for (int i = 0; i < 9; ++i) {
    const double shrink = random.uniform(-1.4, 1.4);
    Path walk = rounded_loop({{-x + shrink, -y + shrink},
                              {x - shrink, -y + shrink},
                              {x - shrink, y - shrink},
                              {-x + shrink, y - shrink}});
    plan.walks.push_back(random.chance(0.5) ? walk.reversed() : walk);
  }
}

void add_room(const Size& size, Random& random, Site& site) {
  const double x = size.half_length;
  const double y = size.half_width;
  site.sheet({-x, -y}, {x, y}, 0.0, Surface::kPlaza);
  site.sheet({-x, -y}, {x, y}, size.height, Surface::kConcrete);
  for (const double side : {-1.0, 1.0}) {
    site.block({-x, side * y - 0.1}, {x, side * y + 0.1}, 0.0, size.height, Surface::kPlaster);
    site.block({side * x - 0.1, -y}, {side * x + 0.1, y}, 0.0, size.height, Surface::kPlaster);
    // Pilasters and doors on the long walls.
    for (double at = -x + random.uniform(2.0, 4.0); at < x - 2.0; at += random.uniform(3.5, 6.5)) {
      const double wall = side * (y - 0.25);
      site.block({at - 0.2, wall - 0.15}, {at + 0.2, wall + 0.15}, 0.0, size.height,
                 Surface::kConcrete);
    }
  }
  for (double at = -x + 3.0; at < x - 1.0; at += 5.0) {
    site.block({at - 0.1, -y}, {at + 0.1, y}, size.height - 0.6, size.height, Surface::kConcrete);
  }
}

/// Shelves, columns and tables inside the tour, some things along the walls.
void add_furnishing(const Size& size, Random& random, Site& site) {
  const double x = size.half_length - 5.2;
  const double y = size.half_width - 5.2;
  for (double row = -y; row < y; row += 3.2) {
    for (double at = -x; at < x - 1.0; at += random.uniform(3.5, 6.0)) {
      if (random.chance(0.3)) continue;
      const double length = random.uniform(1.5, 3.0);
      const double depth = random.uniform(0.5, 0.9);
      const double height = random.uniform(0.8, 2.6);
      const int boards = 1 + static_cast<int>(height / 0.6);
      for (int board = 0; board <= boards; ++board) {
        const double z = height * board / boards;
        site.block({at, row}, {at + length, row + depth}, std::max(0.0, z - 0.04), z + 0.01,
                   Surface::kCabinet);
      }
      for (const double post : {at, at + length}) {
        for (const double side : {row, row + depth}) {
          site.mesh.tube({post, side, 0.0}, {post, side, height}, 0.025, 0.025, 6,
                         Surface::kPoleMetal);
        }
      }
      if (random.chance(0.7)) {
        site.block({at + 0.2, row + 0.1}, {at + 0.6 * length, row + depth - 0.1}, 0.05,
                   0.6 * height, Surface::kBin);
      }
    }
  }
  for (const double column : {-0.5 * size.half_length, 0.5 * size.half_length}) {
    site.block({column - 0.2, -0.2}, {column + 0.2, 0.2}, 0.0, size.height, Surface::kConcrete);
  }
  for (int i = 0; i < 10; ++i) {
    const double side = random.chance(0.5) ? 1.0 : -1.0;
    const double at = random.uniform(-size.half_length + 1.0, size.half_length - 2.0);
    const double depth = random.uniform(0.3, 0.6);
    const double wall = side * (size.half_width - 0.1 - 0.5 * depth);
    site.block({at, wall - 0.5 * depth}, {at + random.uniform(0.6, 1.6), wall + 0.5 * depth}, 0.0,
               random.uniform(0.7, 2.0), Surface::kCabinet);
  }
}

Site build_hall(std::uint64_t seed, std::uint32_t day) {
  Site site;
  build_prototypes(seed, site.prototypes);
  make_plan(seed, site.plan);
  const Size size = size_of(seed);
  Random room(seed, Stream::kBlock, 7);
  add_room(size, room, site);
  add_furnishing(size, room, site);
  // A few pallets are elsewhere every day.
  Random pallets(seed, Stream::kFurniture, 7, day);
  for (int i = 0; i < 4; ++i) {
    const double side = pallets.chance(0.5) ? 1.0 : -1.0;
    const Vec2 at{pallets.uniform(-size.half_length + 5.0, size.half_length - 6.0),
                  side * (size.half_width - 4.9)};
    site.block(at, at + Vec2{1.2, 0.8}, 0.0, pallets.uniform(0.3, 1.4), Surface::kBin);
  }
  return site;
}

ActorSet simulate_hall(const Plan& plan, const Robot& robot, const Visit& visit) {
  ActorSet set;
  Random random(visit.seed, Stream::kPedestrian, visit.day, 7);
  const auto robot_at = [&](double time_s) { return robot.at(time_s); };
  const std::size_t ticks = tick_count(visit.duration_s);
  Strolling strolling(robot_at, ticks, random, set);
  for (const Path& walk : plan.walks) {
    Stroller s;
    s.path = &walk;
    s.cruise = random.uniform(0.8, 1.4);
    s.room = 0.4;
    s.pauses_per_s = random.chance(0.5) ? 1.0 / 15.0 : 0.0;
    s.at = random.uniform(0.0, walk.length());
    if (random.chance(0.3)) s.departs_s = random.uniform(1.0, 15.0);
    strolling.add(s);
  }
  strolling.run();
  remove_colliding_actors(robot_at, ticks, set);
  return set;
}

}  // namespace
}  // namespace unimapper::simulator::sites::hall

namespace unimapper::simulator {

std::unique_ptr<Scene> make_hall_scene(const Visit& visit) {
  return sites::make_site_scene(visit, sites::hall::build_hall, sites::hall::simulate_hall);
}

}  // namespace unimapper::simulator
