// City square: a dense crowd, many of whom stand and then walk.
#include <algorithm>

#include "src/simulator/sites/site_scene.hpp"
#include "src/simulator/strolling.hpp"

namespace unimapper::simulator::sites::square {
namespace {

constexpr double kHalf = 30.0;  // metres from the middle to the house fronts

/// Things that stand on the square; walks keep clear of them.
struct Fixture {
  Vec2 at;
  double radius;
};

std::vector<Fixture> fixtures_of(std::uint64_t seed) {
  Random random(seed, Stream::kFurniture, 3);
  std::vector<Fixture> fixtures{{{random.uniform(-4.0, 4.0), random.uniform(-4.0, 4.0)}, 2.6}};
  for (int tries = 0; tries < 400 && fixtures.size() < 22; ++tries) {
    const Vec2 at{random.uniform(-26.0, 26.0), random.uniform(-26.0, 26.0)};
    const bool is_clear = std::all_of(fixtures.begin(), fixtures.end(), [&](const Fixture& other) {
      return norm(other.at - at) > other.radius + 4.5;
    });
    if (is_clear) fixtures.push_back({at, 0.8});
  }
  return fixtures;
}

bool is_clear(const Path& path, const std::vector<Fixture>& fixtures, double margin) {
  for (double s = 0.0; s < path.length(); s += 0.5) {
    const Vec2 at = path.at(s);
    if (std::max(std::abs(at.x), std::abs(at.y)) > kHalf - 0.8) return false;
    for (const Fixture& fixture : fixtures) {
      if (norm(fixture.at - at) < fixture.radius + margin) return false;
    }
  }
  return true;
}

/// A loop around a random point with `corners` corners.
Path random_loop(Random& random, std::uint32_t corners, double least, double most, Vec2 middle) {
  std::vector<Vec2> loop;
  const double start = random.uniform(0.0, 2.0 * kPi);
  for (std::uint32_t i = 0; i < corners; ++i) {
    const double angle = start + 2.0 * kPi * (i + random.uniform(-0.3, 0.3)) / corners;
    const double radius = random.uniform(least, most);
    loop.push_back(middle + Vec2{radius * std::cos(angle), radius * std::sin(angle)});
  }
  if (random.chance(0.5)) std::reverse(loop.begin(), loop.end());
  return rounded_loop(loop);
}

void make_plan(std::uint64_t seed, Plan& plan) {
  Random random(seed, Stream::kPlan, 3);
  const std::vector<Fixture> fixtures = fixtures_of(seed);
  Path tour = rounded_loop({{-14, -14}, {14, -14}, {14, 14}, {-14, 14}});
  for (int tries = 0; tries < 500; ++tries) {
    Path path = random_loop(random, 6, 10.0, 20.0, {0.0, 0.0});
    if (path.length() < 70.0 || !is_clear(path, fixtures, 0.9)) continue;
    tour = std::move(path);
    break;
  }
  const double length = tour.length();
  plan.set_tours(std::move(tour), 4.0, 14.0, length - 30.0);
  plan.robot = {1.1, 0.8, 0.9, 0.8, 1.9, 30.0};
  for (int tries = 0; tries < 6000 && plan.walks.size() < 120; ++tries) {
    const Vec2 middle{random.uniform(-24.0, 24.0), random.uniform(-24.0, 24.0)};
    Path path = random_loop(random, 3 + random.index(3), 3.0, 14.0, middle);
    if (path.length() > 18.0 && is_clear(path, fixtures, 0.6)) {
      plan.walks.push_back(std::move(path));
    }
  }
}

void add_houses(Random& random, Site& site) {
  for (int side = 0; side < 4; ++side) {
    Frame turn = rotation_frame({0, 0, 0.5 * kPi * side});
    for (double x = -kHalf - 8.0; x < kHalf + 2.0;) {
      const double width = random.uniform(9.0, 16.0);
      Frame front;
      front.origin = {x, kHalf, 0.0};
      const int storeys = 2 + static_cast<int>(random.index(4));
      const HouseShape shape{width,   random.uniform(8.0, 12.0), random.uniform(2.8, 3.4), 0.3,
                             storeys, random.chance(0.6)};
      add_house(site.mesh, turn * front, shape, random);
      x += width + (random.chance(0.2) ? random.uniform(2.5, 6.0) : 0.0);
    }
  }
}

void add_fixtures(std::uint64_t seed, Random& random, Site& site) {
  const std::vector<Fixture> fixtures = fixtures_of(seed);
  // A monument on steps.
  const Vec2 middle = fixtures.front().at;
  const double turn = random.uniform(0.0, kPi);
  Frame base = upright_frame(site.plan.ground(middle), {std::cos(turn), std::sin(turn)});
  site.mesh.box(base, {-1.8, -1.8, 0.0}, {1.8, 1.8, 0.35}, Surface::kConcrete);
  site.mesh.box(base, {-0.9, -0.9, 0.35}, {0.9, 0.9, 2.2}, Surface::kConcrete);
  site.mesh.tube(base({0, 0, 2.2}), base({0, 0, 6.0}), 0.4, 0.3, 12, Surface::kConcrete);
  const Prototypes& p = site.prototypes;
  for (std::size_t i = 1; i < fixtures.size(); ++i) {
    const Vec2 at = fixtures[i].at;
    const double around = random.uniform(0.0, 2.0 * kPi);
    switch (random.index(6)) {
      case 0:
        site.place(p.trees, random.index(11), at, around, 0, 0, random.uniform(0.5, 0.8));
        break;
      case 1:
        site.place(p.lamps, 0, at, around);
        break;
      case 2:
        site.place(p.benches, 0, at, around);
        break;
      case 3:
        site.place(p.bins, 0, at, around);
        break;
      case 4:
        site.place(p.signs, random.index(3), at, around);
        break;
      default: {
        // A stall with a roof on four posts.
        Frame stall = upright_frame(site.plan.ground(at), {std::cos(around), std::sin(around)});
        site.mesh.box(stall, {-0.7, -0.45, 0.75}, {0.7, 0.45, 0.85}, Surface::kBench);
        site.mesh.box(stall, {-0.8, -0.6, 2.3}, {0.8, 0.6, 2.36}, Surface::kCabinet);
        for (const double x : {-0.75, 0.75}) {
          for (const double y : {-0.55, 0.55}) {
            site.mesh.tube(stall({x, y, 0.0}), stall({x, y, 2.3}), 0.025, 0.025, 6,
                           Surface::kPoleMetal);
          }
        }
      }
    }
  }
}

Site build_square(std::uint64_t seed, std::uint32_t day) {
  Site site;
  build_prototypes(seed, site.prototypes);
  make_plan(seed, site.plan);
  site.sheet({-70, -70}, {70, 70}, 0.0, Surface::kPlaza);
  Random random(seed, Stream::kBlock, 3);
  add_houses(random, site);
  Random furniture(seed, Stream::kFurniture, 4, day);
  add_fixtures(seed, furniture, site);
  return site;
}

ActorSet simulate_square(const Plan& plan, const Robot& robot, const Visit& visit) {
  ActorSet set;
  Random random(visit.seed, Stream::kPedestrian, visit.day, 3);
  const auto robot_at = [&](double time_s) { return robot.at(time_s); };
  const std::size_t ticks = tick_count(visit.duration_s);
  Strolling strolling(robot_at, ticks, random, set);
  for (const Path& walk : plan.walks) {
    Stroller s;
    s.path = &walk;
    s.size = random.chance(0.5) ? 1 : 2 + random.index(3);
    s.cruise = random.uniform(0.7, 1.5);
    s.radius = kPersonRadius + 0.5 * kAbreast * (std::min(s.size, 3U) - 1);
    s.pauses_per_s = random.chance(0.4) ? 1.0 / 20.0 : 0.0;
    s.at = random.uniform(0.0, walk.length());
    // Two of five stand first, but not where the robot is going to drive.
    const Vec2 at = walk.at(s.at);
    const Path& tour = robot.path();
    const bool is_on_tour = norm(tour.at(tour.nearest(at)) - at) < 1.2 + s.radius;
    if (random.chance(0.4) && !is_on_tour) s.departs_s = random.uniform(0.5, 25.0);
    strolling.add(s);
  }
  strolling.run();
  remove_colliding_actors(robot_at, ticks, set);
  return set;
}

}  // namespace
}  // namespace unimapper::simulator::sites::square

namespace unimapper::simulator {

std::unique_ptr<Scene> make_square_scene(const Visit& visit) {
  return sites::make_site_scene(visit, sites::square::build_square, sites::square::simulate_square);
}

}  // namespace unimapper::simulator
