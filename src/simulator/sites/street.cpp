// Street of hard cases: walkers at surfaces that were never seen before, a parked truck beside
// passing vans, thin poles, plants before walls; and two that are alike.
#include <algorithm>

#include "src/simulator/displaced_scene.hpp"
#include "src/simulator/sites/site_scene.hpp"

namespace unimapper::simulator::sites::street {
namespace {

// The robot drives around a block: two streets of 190 m and two short ones.
constexpr double kHalfLength = 95.0;
constexpr double kLane = 35.0;        // metres from the middle of the block to the robot's lane
constexpr double kOncoming = 31.9;    // to the middle of the opposite lane
constexpr double kTruck = 29.0;       // to trucks that are parked on the far side
constexpr double kInnerFront = 25.0;  // to the houses of the block
constexpr double kOuterFront = 40.0;  // to the house fronts beside the robot
constexpr double kDeepest = 16.0;     // bottom of the recesses, at most
constexpr double kBehindCar = 0.4;    // between a parked car and the wall behind it
constexpr double kPersonHalf = 0.22;  // half the breadth of a walker
constexpr double kCarHalf = 0.95;

/// Metres per second of the robot.
double speed_of(std::uint64_t seed) {
  Random random(seed, Stream::kPlan, 5);
  return random.uniform(5.0, 8.0);
}

/// A gap between two house fronts in which somebody walks. From the robot's lane what is inside
/// comes into view and goes out of it again within `kInView` seconds.
struct Recess {
  double x;      ///< middle
  double side;   ///< +1 or -1: which of the long streets
  bool has_car;  ///< a parked car along the back wall
  double gap;    ///< between the walker's body and the surface
  double half_width, depth;

  [[nodiscard]] double walker_depth() const {
    const double surface = has_car ? depth - kBehindCar - 2.0 * kCarHalf : depth;
    return surface - gap - kPersonHalf;
  }
};

/// Something `depth` behind an opening of `width` is in view over width (lane + depth) / depth
/// metres of the lane, `lane` metres before the opening.
Recess sized(Recess recess, double speed) {
  constexpr double kInView = 1.6;
  constexpr double kLaneToFront = kOuterFront - kLane;
  const double way = kInView * speed;
  if (!recess.has_car) {
    recess.depth = 3.0;
    const double depth = recess.walker_depth();
    recess.half_width = 0.5 * way * depth / (kLaneToFront + depth);
    return recess;
  }
  recess.half_width = 2.6;
  const double depth = kLaneToFront / (0.5 * way / recess.half_width - 1.0);
  recess.depth = depth + kPersonHalf + recess.gap + 2.0 * kCarHalf + kBehindCar;
  return recess;
}

std::vector<Recess> recesses_of(std::uint64_t seed) {
  Random random(seed, Stream::kBlock, 5);
  std::vector<Recess> recesses;
  for (const double side : {-1.0, 1.0}) {
    for (double x = -78.0 + random.uniform(0.0, 6.0); x < 78.0; x += random.uniform(14.0, 22.0)) {
      const Recess recess{x, side, random.chance(0.4), random.uniform(0.2, 0.5), 0.0, 0.0};
      recesses.push_back(sized(recess, speed_of(seed)));
    }
  }
  return recesses;
}

void make_plan(std::uint64_t seed, std::uint32_t day, Plan& plan) {
  const double x = kHalfLength - 4.0;
  const Path loop = rounded_loop({{-x, -kLane}, {x, -kLane}, {x, kLane}, {-x, kLane}});
  plan.set_tours(loop, 15.0, 40.0, 25.0);
  // Against the robot's lane all the others drive on the inside of the loop.
  const double inner = x - (kLane - kOncoming);
  plan.lanes.push_back(rounded_loop(
      {{-inner, -kOncoming}, {-inner, kOncoming}, {inner, kOncoming}, {inner, -kOncoming}}));
  plan.robot = {speed_of(seed), 1.3, 1.9, 0.25, 1.5, 0.0};
  Random walkers(seed, Stream::kPedestrian, 5, day);
  for (const Recess& recess : recesses_of(seed)) {
    const double y = recess.side * (kOuterFront + recess.walker_depth());
    const double reach = (walkers.chance(0.5) ? 1.0 : -1.0) * (recess.half_width - 0.4);
    plan.spots.push_back(
        {{recess.x - reach, y}, {recess.x + reach, y}, {recess.x, recess.side * kLane}});
  }
}

void add_fronts(const std::vector<Recess>& recesses, Random& random, Site& site) {
  for (const double side : {-1.0, 1.0}) {
    const auto row = [&](double x0, double x1, double from, double to, double top,
                         Surface surface) {
      site.mesh.box({}, {x0, std::min(side * from, side * to), 0.0},
                    {x1, std::max(side * from, side * to), top}, surface);
    };
    double x = -kHalfLength - 20.0;
    for (const Recess& recess : recesses) {
      if (recess.side != side) continue;
      const Surface surface = random.chance(0.5) ? Surface::kPlaster : Surface::kBrick;
      row(x, recess.x - recess.half_width, kOuterFront, kOuterFront + kDeepest,
          random.uniform(6.0, 11.0), surface);
      row(recess.x - recess.half_width, recess.x + recess.half_width, kOuterFront + recess.depth,
          kOuterFront + kDeepest + 1.0, 7.0, Surface::kPlaster);
      x = recess.x + recess.half_width;
    }
    row(x, kHalfLength + 20.0, kOuterFront, kOuterFront + kDeepest, 8.0, Surface::kBrick);
    // The houses of the block, and the ends of the short streets.
    for (double at = -kHalfLength + 14.0; at < kHalfLength - 20.0;) {
      const double width = random.uniform(10.0, 18.0);
      Frame front = rotation_frame({0, 0, side > 0.0 ? kPi : 0.0});
      front.origin = {side > 0.0 ? at + width : at, -kInnerFront, 0.0};
      if (side > 0.0) front.origin.y = kInnerFront;
      const HouseShape shape{
          width, 9.0, 3.0, 0.3, 2 + static_cast<int>(random.index(3)), random.chance(0.4)};
      add_house(site.mesh, front, shape, random);
      at += width + random.uniform(0.0, 2.0);
    }
    const double end = side * (kHalfLength + 6.0);
    site.mesh.box({}, {std::min(end, end + side), -kOuterFront, 0.0},
                  {std::max(end, end + side), kOuterFront, 7.0}, Surface::kConcrete);
  }
}

/// Poles of 6 to 15 cm on both sides of the street, some with a sign.
void add_poles(Random& random, Site& site) {
  for (const double side : {-1.0, 1.0}) {
    for (const double y : {side * (kOuterFront - 1.6), side * (kInnerFront + 1.2)}) {
      for (double x = -85.0; x < 85.0; x += random.uniform(7.0, 14.0)) {
        const double radius = random.uniform(0.03, 0.075);
        const double height = random.uniform(2.4, 6.0);
        site.mesh.tube({x, y, -0.1}, {x, y, height}, radius, radius, 10, Surface::kPoleMetal);
        if (random.chance(0.4)) {
          site.mesh.disc({x - 0.09, y, 2.3}, {1, 0, 0}, 0.3, 14, Surface::kSign);
        }
      }
    }
  }
}

/// Bushes, hedges and trees before the walls between the recesses.
void add_plants(const std::vector<Recess>& recesses, Random& random, Site& site) {
  const Prototypes& p = site.prototypes;
  for (const double side : {-1.0, 1.0}) {
    for (double x = -88.0; x < 88.0; x += random.uniform(2.0, 5.0)) {
      const bool is_open = std::any_of(recesses.begin(), recesses.end(), [&](const Recess& r) {
        return r.side == side && std::abs(r.x - x) < r.half_width + 1.3;
      });
      if (is_open || random.chance(0.35)) continue;
      const Vec2 at{x, side * (kOuterFront - random.uniform(0.4, 0.8))};
      switch (random.index(4)) {
        case 0:
          site.place(p.hedges, random.index(3), at, 0.0);
          break;
        case 1:
          site.place(p.trees, random.index(11), at, random.uniform(0.0, 6.28), 0, 0, 0.6);
          break;
        default:
          site.place(p.bushes, random.index(6), at, random.uniform(0.0, 6.28));
      }
    }
  }
}

/// A lorry with a box, 7.4 m long.
Mesh make_truck() {
  Mesh mesh;
  mesh.box({}, {1.9, -1.1, 0.5}, {3.7, 1.1, 2.5}, Surface::kPaintMid);
  mesh.quad({3.71, -1.0, 1.5}, {3.71, 1.0, 1.5}, {3.71, 0.9, 2.4}, {3.71, -0.9, 2.4},
            Surface::kCarGlass);
  mesh.box({}, {-3.7, -1.25, 0.95}, {1.7, 1.25, 3.3}, Surface::kPaintLight);
  mesh.box({}, {-3.6, -0.45, 0.55}, {1.9, 0.45, 0.95}, Surface::kCarTrim);
  for (const double x : {-2.4, 2.7}) {
    for (const double y : {-1.0, 1.0}) {
      mesh.tube({x, y - 0.15, 0.48}, {x, y + 0.15, 0.48}, 0.48, 0.48, 14, Surface::kTyre);
      mesh.disc({x, y + (y > 0 ? 0.15 : -0.15), 0.48}, {0, 1, 0}, 0.48, 14, Surface::kTyre);
    }
  }
  return mesh;
}

void add_parked_vehicles(std::uint64_t seed, std::uint32_t day, const std::vector<Recess>& recesses,
                         Site& site) {
  std::uint16_t object = 1;
  const PrototypeRange trucks{static_cast<std::uint32_t>(site.prototypes.meshes.size()), 1};
  site.prototypes.meshes.push_back(make_truck());
  Random random(seed, Stream::kParking, 5, day);
  for (const Recess& recess : recesses) {
    if (!recess.has_car) continue;
    const double y = recess.side * (kOuterFront + recess.depth - kBehindCar - kCarHalf);
    site.place(site.prototypes.cars, random.index(site.prototypes.cars.count), {recess.x, y},
               random.chance(0.5) ? 0.0 : kPi, label::kCar, object++);
  }
  for (const double side : {-1.0, 1.0}) {
    for (double x = -70.0 + random.uniform(0.0, 15.0); x < 70.0; x += random.uniform(12.0, 35.0)) {
      const bool is_truck = random.chance(0.6);
      const PrototypeRange range = is_truck ? trucks : site.prototypes.cars;
      site.place(range, random.index(range.count), {x, side * (is_truck ? kTruck : kTruck - 0.2)},
                 side > 0.0 ? 0.0 : kPi, is_truck ? label::kTruck : label::kCar, object++);
    }
  }
}

Site build_street(std::uint64_t seed, std::uint32_t day) {
  Site site;
  build_prototypes(seed, site.prototypes);
  make_plan(seed, day, site.plan);
  const std::vector<Recess> recesses = recesses_of(seed);
  site.sheet({-130, -70}, {130, 70}, 0.0, Surface::kRoad);
  constexpr double kPaving = 0.02;
  for (const double side : {-1.0, 1.0}) {
    const double outer[] = {side * (kOuterFront - 2.2), side * (kOuterFront + kDeepest)};
    site.sheet({-130.0, std::min(outer[0], outer[1])}, {130.0, std::max(outer[0], outer[1])},
               kPaving, Surface::kSidewalk);
  }
  site.sheet({-kHalfLength + 10.0, -kInnerFront - 2.0}, {kHalfLength - 10.0, kInnerFront + 2.0},
             kPaving, Surface::kSidewalk);
  Random random(seed, Stream::kBlock, 6);
  add_fronts(recesses, random, site);
  Random furniture(seed, Stream::kFurniture, 5);
  add_poles(furniture, site);
  add_plants(recesses, furniture, site);
  add_parked_vehicles(seed, day, recesses, site);
  return site;
}

/// Walks from one end of its way to the other while the robot passes.
void add_walker(const Spot& spot, double passed_s, std::size_t ticks, Random& random,
                ActorSet& set) {
  const double way = norm(spot.to - spot.from);
  const double speed = random.uniform(1.0, 1.5);
  const double begins_s = passed_s - 0.5 * way / speed + random.uniform(-0.2, 0.2);
  set.paths.push_back(Path({spot.from, spot.to}, false));
  Actor actor;
  actor.kind = ActorKind::kPerson;
  actor.variant = random.index(12);
  actor.scale = random.uniform(0.93, 1.07);
  actor.path = &set.paths.back();
  for (std::size_t tick = 0; tick < ticks; ++tick) {
    const double walked = speed * (Actors::time_of(tick) - begins_s);
    actor.travelled.push_back(static_cast<float>(std::clamp(walked, 0.0, way)));
  }
  set.actors.push_back(std::move(actor));
}

/// Vans and cars at steady speeds in the opposite lane, so that none catches up with another.
void add_oncoming(const Plan& plan, std::size_t ticks, Random& random, ActorSet& set) {
  const Path& lane = plan.lanes.front();
  const double speed = random.uniform(6.0, 8.5);
  for (double s = random.uniform(0.0, 20.0); s < lane.length() - 18.0;
       s += random.uniform(18.0, 55.0)) {
    Actor actor;
    actor.kind = random.chance(0.6) ? ActorKind::kVan : ActorKind::kCar;
    actor.variant = random.index(9);
    actor.path = &lane;
    for (std::size_t tick = 0; tick < ticks; ++tick) {
      actor.travelled.push_back(
          static_cast<float>(s + speed * (Actors::time_of(tick) + Actors::kWarmUp)));
    }
    set.actors.push_back(std::move(actor));
  }
}

ActorSet simulate_street(const Plan& plan, const Robot& robot, const Visit& visit) {
  ActorSet set;
  Random random(visit.seed, Stream::kTraffic, visit.day, 5);
  const std::size_t ticks = tick_count(visit.duration_s);
  add_oncoming(plan, ticks, random, set);
  for (const Spot& spot : plan.spots) {
    const double passed_s = robot.passes(spot.seen_from, 3.0);
    if (passed_s >= 0.0) add_walker(spot, passed_s, ticks, random, set);
  }
  return set;
}

}  // namespace
}  // namespace unimapper::simulator::sites::street

namespace unimapper::simulator {

std::unique_ptr<Scene> make_street_scene(const Visit& visit) {
  return sites::make_site_scene(visit, sites::street::build_street, sites::street::simulate_street);
}

std::unique_ptr<Scene> make_streets_scene(const Visit& visit) {
  Frame next_block;
  next_block.origin.y = 150.0;
  return make_original_or_copy(visit, next_block, make_street_scene);
}

}  // namespace unimapper::simulator
