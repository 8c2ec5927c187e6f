// Corridor around a building's core, with doors at one distance all along, and its copy.
#include "src/simulator/displaced_scene.hpp"
#include "src/simulator/sites/site_scene.hpp"
#include "src/simulator/strolling.hpp"

namespace unimapper::simulator::sites::corridor {
namespace {

constexpr double kHalfLength = 60.0;  // metres from the middle to the middle of a short corridor
constexpr double kHalfWidth = 12.0;   // to the middle of a long one
constexpr double kHalfCorridor = 1.5;
constexpr double kHeight = 2.7;
constexpr double kHalfDoor = 0.5;
constexpr double kReveal = 0.2;  // depth of a door behind the wall

/// Metres from door to door.
double period_of(std::uint64_t seed) {
  Random random(seed, Stream::kPlan, 8);
  return 3.0 + 0.5 * random.index(7);
}

void make_plan(Plan& plan) {
  const auto loop = [](double outward) {
    const double x = kHalfLength + outward;
    const double y = kHalfWidth + outward;
    return rounded_loop({{-x, -y}, {x, -y}, {x, y}, {-x, y}});
  };
  plan.set_tours(loop(0.0), 4.0, 16.0, 4.0);
  plan.robot = {1.4, 0.8, 0.7, 0.3, 1.8, 30.0};
  for (const double outward : {-0.8, 0.8}) {
    plan.walks.push_back(loop(outward));
    plan.walks.push_back(loop(outward).reversed());
  }
}

/// A wall along a long corridor, its face towards `inward` (+1 or -1 along y), with doors at every
/// `period` on either side of the middle.
void add_wall_with_doors(double half_length, double face, double inward, double period,
                         Site& site) {
  const auto block = [&](double x0, double x1, double from, double to, Surface surface) {
    const double a = face - inward * from;
    const double b = face - inward * to;
    site.block({x0, std::min(a, b)}, {x1, std::max(a, b)}, 0.0, kHeight, surface);
  };
  double x = -half_length;
  const auto doors = static_cast<int>((half_length - 1.5) / period);
  for (int door = -doors; door <= doors; ++door) {
    const double middle = period * door;
    block(x, middle - kHalfDoor, 0.0, kReveal + 0.1, Surface::kPlaster);
    block(middle - kHalfDoor, middle + kHalfDoor, kReveal, kReveal + 0.05, Surface::kCabinet);
    x = middle + kHalfDoor;
  }
  block(x, half_length, 0.0, kReveal + 0.1, Surface::kPlaster);
}

void add_building(double period, Site& site) {
  const Vec2 outer{kHalfLength + kHalfCorridor, kHalfWidth + kHalfCorridor};
  const Vec2 inner{kHalfLength - kHalfCorridor, kHalfWidth - kHalfCorridor};
  site.sheet({-outer.x, -outer.y}, outer, 0.0, Surface::kPlaza);
  site.sheet({-outer.x, -outer.y}, outer, kHeight, Surface::kPlaster);
  for (const double side : {-1.0, 1.0}) {
    add_wall_with_doors(outer.x, side * outer.y, -side, period, site);
    add_wall_with_doors(inner.x, side * inner.y, side, period, site);
    for (const double x : {side * (outer.x + 0.05), side * (inner.x - 0.05)}) {
      const double half = std::abs(x) > kHalfLength ? outer.y : inner.y;
      site.block({x - 0.05, -half}, {x + 0.05, half}, 0.0, kHeight, Surface::kPlaster);
    }
    // A lamp before every door.
    const auto lamps = static_cast<int>((outer.x - 1.5) / period);
    for (int lamp = -lamps; lamp <= lamps; ++lamp) {
      const Vec2 at{period * lamp, side * kHalfWidth};
      site.block(at - Vec2{0.6, 0.1}, at + Vec2{0.6, 0.1}, kHeight - 0.1, kHeight,
                 Surface::kCabinet);
    }
  }
}

Site build_corridor(std::uint64_t seed, std::uint32_t day) {
  Site site;
  build_prototypes(seed, site.prototypes);
  make_plan(site.plan);
  add_building(period_of(seed), site);
  // Carts along the walls are elsewhere every day.
  Random carts(seed, Stream::kFurniture, 8, day);
  for (int i = 0; i < 8; ++i) {
    const double wall = (carts.chance(0.5) ? 1.0 : -1.0) * (kHalfCorridor - 0.3);
    const Vec2 at{carts.uniform(-kHalfLength + 4.0, kHalfLength - 4.0),
                  (carts.chance(0.5) ? 1.0 : -1.0) * kHalfWidth + wall};
    site.block(at - Vec2{0.5, 0.25}, at + Vec2{0.5, 0.25}, 0.0, carts.uniform(0.5, 1.3),
               Surface::kBin);
  }
  return site;
}

ActorSet simulate_corridor(const Plan& plan, const Robot& robot, const Visit& visit) {
  ActorSet set;
  Random random(visit.seed, Stream::kPedestrian, visit.day, 8);
  const auto robot_at = [&](double time_s) { return robot.at(time_s); };
  const std::size_t ticks = tick_count(visit.duration_s);
  Strolling strolling(robot_at, ticks, random, set);
  for (const Path& walk : plan.walks) {
    for (int i = 0; i < 3; ++i) {
      Stroller s;
      s.path = &walk;
      s.cruise = random.uniform(0.9, 1.5);
      s.room = 0.3;
      s.pauses_per_s = random.chance(0.3) ? 1.0 / 15.0 : 0.0;
      s.at = random.uniform(0.0, walk.length());
      strolling.add(s);
    }
  }
  strolling.run();
  remove_colliding_actors(robot_at, ticks, set);
  return set;
}

}  // namespace
}  // namespace unimapper::simulator::sites::corridor

namespace unimapper::simulator {

std::unique_ptr<Scene> make_corridor_scene(const Visit& visit) {
  using namespace sites::corridor;
  Frame next_building;
  next_building.origin = {0.0, 2.0 * kHalfWidth + 20.0, 0.0};
  return make_original_or_copy(visit, next_building, [](const Visit& place) {
    return sites::make_site_scene(place, build_corridor, simulate_corridor);
  });
}

}  // namespace unimapper::simulator
