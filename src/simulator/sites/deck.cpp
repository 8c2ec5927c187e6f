// Parking deck: a low ceiling with beams, columns, parked cars, walkers, on some seeds a ramp; and
// two storeys of a garage that are alike.
#include "src/simulator/displaced_scene.hpp"
#include "src/simulator/sites/site_scene.hpp"
#include "src/simulator/strolling.hpp"

namespace unimapper::simulator::sites::deck {
namespace {

constexpr double kHalfLength = 36.0;
constexpr double kHalfWidth = 18.0;
constexpr double kAisle = 9.0;  // metres from the middle to the middle of an aisle
constexpr double kCrossAisle = 33.0;
constexpr double kBays = 30.0;  // bays lie within this distance of the middle
constexpr double kBayWidth = 2.5;
constexpr double kFrame = 7.5;  // between beams
constexpr double kColumnRows[] = {-11.8, -6.2, 0.0, 6.2, 11.8};

constexpr double kSlab = 0.3;  // thickness of the ceiling

/// A storey of a garage has closed walls and no ramp, so that nothing tells it from the next.
enum class Kind : std::uint8_t { kDeck, kStorey };

/// Height of the ceiling above the ground.
double clear_height(Random& random) { return random.uniform(2.5, 3.5); }

/// Key of what is parked: the copy of a storey has cars of its own.
std::uint64_t parking_key(std::uint64_t seed, std::uint32_t day) {
  return day < kDaysOfCopy ? seed : derive_key(seed, kDaysOfCopy);
}

void make_plan(std::uint64_t seed, Kind kind, Plan& plan) {
  Random random(seed, Stream::kPlan, 2);
  if (random.chance(0.5) && kind == Kind::kDeck) {
    plan.rise_m = random.uniform(1.2, 2.2);
    plan.ramp_from = -14.0;
    plan.ramp_to = 14.0;
  }
  const double x = kCrossAisle;
  const Path loop = rounded_loop({{-x, -kAisle}, {x, -kAisle}, {x, kAisle}, {-x, kAisle}});
  plan.set_tours(loop, 12.0, 22.0, loop.length() - 45.0);
  plan.robot = {3.0, 1.2, 1.5, 0.25, 1.6, 35.0};
  for (int i = 0; i < 12; ++i) {
    const double side = i % 2 == 0 ? -1.0 : 1.0;
    const double middle = random.uniform(-18.0, 18.0);
    const double half = random.uniform(6.0, 12.0);
    const double near = random.uniform(1.4, 1.9);
    std::vector<Vec2> corners{{middle - half, side * kAisle - near},
                              {middle + half, side * kAisle - near},
                              {middle + half, side * kAisle + near},
                              {middle - half, side * kAisle + near}};
    if (random.chance(0.5)) std::swap(corners[1], corners[3]);
    plan.walks.push_back(rounded_loop(corners));
  }
  plan.lanes.push_back(loop);
}

/// The surroundings a storey below, seen through the openings.
void add_surroundings(Random& random, Site& site) {
  constexpr double kBelow = -3.4;
  constexpr double kReach = 110.0;
  site.mesh.quad({-kReach, -kReach, kBelow}, {kReach, -kReach, kBelow}, {kReach, kReach, kBelow},
                 {-kReach, kReach, kBelow}, Surface::kLawn);
  for (const double side : {-1.0, 1.0}) {
    for (double x = -90.0; x < 80.0;) {
      const double width = random.uniform(12.0, 26.0);
      const double front = side * random.uniform(32.0, 42.0);
      site.mesh.box({}, {x, std::min(front, front + 12.0 * side), kBelow},
                    {x + width, std::max(front, front + 12.0 * side), random.uniform(3.0, 11.0)},
                    Surface::kBrick);
      x += width + random.uniform(3.0, 9.0);
    }
  }
}

void add_ceiling(double clear, Random& random, Site& site) {
  const Vec2 low{-kHalfLength, -kHalfWidth};
  const Vec2 high{kHalfLength, kHalfWidth};
  site.sheet(low, high, clear, Surface::kConcrete);
  site.sheet(low, high, clear + kSlab, Surface::kConcrete);
  const double depth = random.uniform(0.3, 0.45);
  const double half = random.uniform(0.15, 0.22);
  for (double x = -kBays; x <= kBays + 0.1; x += kFrame) {
    site.block({x - half, -kHalfWidth}, {x + half, kHalfWidth}, clear - depth, clear,
               Surface::kConcrete);
  }
  for (const double y : kColumnRows) {
    site.block({-kHalfLength, y - half}, {kHalfLength, y + half}, clear - 0.6 * depth, clear,
               Surface::kConcrete);
  }
  // A pipe and a row of lamps over each aisle.
  for (const double side : {-1.0, 1.0}) {
    const double pipe = side * (kAisle + random.uniform(1.2, 2.2));
    for (double x = -kHalfLength; x < kHalfLength; x += 4.0) {
      const double lift = clear - depth - 0.12;
      site.mesh.tube(site.plan.ground({x, pipe}, lift), site.plan.ground({x + 4.0, pipe}, lift),
                     0.07, 0.07, 8, Surface::kCabinet);
    }
    for (double x = -32.0; x < 33.0; x += 5.0) {
      site.block({x - 0.7, side * kAisle - 0.08}, {x + 0.7, side * kAisle + 0.08}, clear - 0.12,
                 clear, Surface::kCabinet);
    }
  }
}

void add_columns_and_walls(double clear, Kind kind, Random& random, Site& site) {
  const double half = random.uniform(0.2, 0.3);
  for (double x = -kBays; x <= kBays + 0.1; x += kFrame) {
    for (const double y : kColumnRows) {
      site.block({x - half, y - half}, {x + half, y + half}, 0.0, clear, Surface::kConcrete);
    }
  }
  for (const double side : {-1.0, 1.0}) {
    // A parapet with openings above it, or a closed wall.
    for (double x = -kHalfLength; x < kHalfLength - 0.1; x += 6.0) {
      const double y = side * (kHalfWidth - 0.1);
      const double top = random.chance(kind == Kind::kDeck ? 0.35 : 1.0) ? clear : 1.1;
      site.block({x, y - 0.1}, {x + 6.0, y + 0.1}, 0.0, top, Surface::kConcrete);
    }
    site.block({-kHalfLength, side * kHalfWidth - 0.15}, {kHalfLength, side * kHalfWidth + 0.15},
               clear - 0.45, clear, Surface::kConcrete);
    const double x = side * (kHalfLength - 0.1);
    site.block({x - 0.1, -kHalfWidth}, {x + 0.1, kHalfWidth}, 0.0, clear, Surface::kPlaster);
    // Stair wells in the corners.
    const double y = (random.chance(0.5) ? 1.0 : -1.0) * (kHalfWidth - 2.0);
    site.block({x - 1.5, y - 1.6}, {x + 1.5, y + 1.6}, 0.0, clear, Surface::kBrick);
  }
}

void add_parked_cars(std::uint64_t seed, std::uint32_t day, Site& site) {
  std::uint16_t object = 1;
  Random demand_random(seed, Stream::kParking, 1);
  const double demand = demand_random.uniform(0.45, 0.8);
  std::uint64_t bay = 0;
  for (const double row : {-15.0, -3.1, 3.1, 15.0}) {
    for (double x = -kBays + 0.5 * kBayWidth; x < kBays; x += kBayWidth) {
      // Half of the bays look the same on all days.
      Random habit(seed, Stream::kParking, 2, ++bay);
      const bool changes = habit.chance(0.5);
      Random random(changes ? seed + 104729ULL * (day + 1) : seed, Stream::kParking, 3, bay);
      if (!random.chance(demand)) continue;
      const bool is_van = site.plan.rise_m == 0.0 && random.chance(0.05);
      const PrototypeRange range = is_van ? site.prototypes.vans : site.prototypes.cars;
      const double turn = (random.chance(0.6) ? 0.5 : -0.5) * kPi + random.uniform(-0.04, 0.04);
      site.place(range, random.index(range.count),
                 {x + random.uniform(-0.12, 0.12), row + random.uniform(-0.2, 0.2)}, turn,
                 is_van ? label::kTruck : label::kCar, object++);
    }
  }
}

Site build(std::uint64_t seed, std::uint32_t day, Kind kind) {
  Site site;
  build_prototypes(seed, site.prototypes);
  make_plan(seed, kind, site.plan);
  Random random(seed, Stream::kBlock, 2);
  const double clear = clear_height(random);
  site.sheet({-kHalfLength, -kHalfWidth}, {kHalfLength, kHalfWidth}, 0.0, Surface::kParkingLot);
  add_ceiling(clear, random, site);
  add_columns_and_walls(clear, kind, random, site);
  if (kind == Kind::kDeck) add_surroundings(random, site);
  add_parked_cars(parking_key(seed, day), day, site);
  return site;
}

Site build_deck(std::uint64_t seed, std::uint32_t day) { return build(seed, day, Kind::kDeck); }

Site build_storey(std::uint64_t seed, std::uint32_t day) { return build(seed, day, Kind::kStorey); }

ActorSet simulate_deck(const Plan& plan, const Robot& robot, const Visit& visit) {
  ActorSet set;
  Random random(visit.seed, Stream::kPedestrian, visit.day, 2);
  const auto robot_at = [&](double time_s) { return robot.at(time_s); };
  const std::size_t ticks = tick_count(visit.duration_s);
  Strolling strolling(robot_at, ticks, random, set);
  for (const Path& walk : plan.walks) {
    Stroller s;
    s.path = &walk;
    s.size = random.chance(0.7) ? 1 : 2;
    s.cruise = random.uniform(0.8, 1.5);
    s.radius = s.size == 1 ? kPersonRadius : kPersonRadius + 0.5 * kAbreast;
    s.room = 0.4;
    s.pauses_per_s = random.chance(0.3) ? 1.0 / 20.0 : 0.0;
    s.at = random.uniform(0.0, walk.length());
    if (random.chance(0.3)) s.departs_s = random.uniform(1.0, 20.0);
    strolling.add(s);
  }
  // One car ahead of the robot, and one behind that stops now and then.
  for (const double lead : {random.uniform(10.0, 18.0), random.uniform(-26.0, -18.0)}) {
    Stroller s;
    s.kind = ActorKind::kCar;
    s.path = &robot.path();
    s.cruise = lead > 0.0 ? random.uniform(3.0, 3.4) : random.uniform(2.4, 3.0);
    s.room = 0.0;
    s.radius = 1.0;
    s.half_length = 2.3;
    s.pauses_per_s = lead > 0.0 ? 0.0 : 1.0 / 30.0;
    s.at = robot.travelled(-Actors::kWarmUp) + lead;
    strolling.add(s);
  }
  strolling.run();
  remove_colliding_actors(robot_at, ticks, set);
  return set;
}

}  // namespace
}  // namespace unimapper::simulator::sites::deck

namespace unimapper::simulator {

std::unique_ptr<Scene> make_deck_scene(const Visit& visit) {
  return sites::make_site_scene(visit, sites::deck::build_deck, sites::deck::simulate_deck);
}

std::unique_ptr<Scene> make_decks_scene(const Visit& visit) {
  using namespace sites::deck;
  Random random(visit.seed, Stream::kBlock, 2);
  Frame above;
  above.origin.z = clear_height(random) + kSlab;
  return make_original_or_copy(visit, above, [](const Visit& place) {
    return sites::make_site_scene(place, build_storey, simulate_deck);
  });
}

}  // namespace unimapper::simulator
