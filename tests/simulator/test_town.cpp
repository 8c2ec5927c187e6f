// Tests of the town: geometry, routes and traffic.
#include "src/simulator/actors.hpp"
#include "src/simulator/town.hpp"
#include "src/simulator/traffic.hpp"
#include "tests/simulator/kept.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::simulator;
using namespace unimapper::simulator::test;

namespace {

constexpr std::uint64_t kSeed = 11;

struct Step {
  Vec2 at, heading;
};

/// Position and heading at every scan.
std::vector<Step> drive(const TownPlan& plan, char route, int scans) {
  const RobotMotion robot(plan, route, kSeed, 0.1 * scans);
  std::vector<Step> steps;
  for (int i = 0; i < scans; ++i) {
    const Frame f = robot.sensor_frame(0.1 * (i + 1));
    steps.push_back({{f.origin.x, f.origin.y}, normalized(Vec2{f.x.x, f.x.y})});
  }
  return steps;
}

/// Share of `a` that has a step of `b` within `reach` metres and with `sign` times its heading.
double shared(const std::vector<Step>& a, const std::vector<Step>& b, double reach, double sign) {
  const auto is_shared = [&](const Step& step) {
    return std::any_of(b.begin(), b.end(), [&](const Step& other) {
      return norm(step.at - other.at) < reach && sign * dot(step.heading, other.heading) > 0.8;
    });
  };
  return static_cast<double>(std::count_if(a.begin(), a.end(), is_shared)) /
         static_cast<double>(a.size());
}

Actors traffic_of(const Town& town, const RobotMotion& robot, double duration) {
  return {town.prototypes, town.plan, Traffic(town.plan, robot, kSeed, 0, duration).take()};
}

}  // namespace

TEST_CASE("A and B share streets in the same direction, C drives it the other way, all early") {
  const std::uint64_t seed = GENERATE(std::uint64_t{1}, std::uint64_t{2}, std::uint64_t{kSeed});
  const TownPlan plan(seed);
  const auto a = drive(plan, 'A', 300);
  const auto b = drive(plan, 'B', 300);
  const auto c = drive(plan, 'C', 300);
  CHECK(shared(a, b, 2.0, 1.0) > 0.3);
  CHECK(shared(a, c, 6.0, -1.0) > 0.4);
  CHECK(shared(b, c, 6.0, -1.0) > 0.4);
}

TEST_CASE("every route comes back to a street it has driven within sixty seconds") {
  const TownPlan plan(kSeed);
  const char route = GENERATE('A', 'B', 'C');
  const auto steps = drive(plan, route, 620);
  const std::vector<Step> early(steps.begin(), steps.begin() + 200);
  const std::vector<Step> late(steps.begin() + 400, steps.end());
  CHECK(shared(late, early, 2.0, 1.0) > 0.1);
}

TEST_CASE("the robot drives like a car in town") {
  const TownPlan plan(kSeed);
  const RobotMotion robot(plan, 'A', kSeed, 100.0);
  CHECK(robot.travelled(30.0) - robot.travelled(0.0) > 170.0);
  CHECK(robot.travelled(30.0) - robot.travelled(0.0) < 270.0);
  for (double t = 0.5; t < 100.0; t += 0.1) {
    const Frame now = robot.sensor_frame(t);
    const Frame before = robot.sensor_frame(t - 0.1);
    const double speed = norm(now.origin - before.origin) / 0.1;
    CHECK_FALSE(speed < 2.0);
    CHECK_FALSE(speed > 10.0);
    const double turn = norm(rotation_vector(before.inverse() * now)) / 0.1;
    CHECK_FALSE(turn > 1.3);      // rad/s
    CHECK_FALSE(now.z.z < 0.98);  // slopes, not cliffs
    const double height = now.origin.z - plan.height({now.origin.x, now.origin.y});
    CHECK_FALSE(std::abs(height - 1.9) > 0.1);
  }
}

TEST_CASE("houses and trees stay from day to day, half of the parked cars do not") {
  const Town monday = build_town(kSeed, 0);
  const Town tuesday = build_town(kSeed, 1);
  CHECK((monday.mesh.positions == tuesday.mesh.positions));
  const auto kept = [&](PrototypeRange range) { return kept_share(monday, tuesday, range); };
  CHECK(kept(monday.prototypes.trees) == 1.0);
  CHECK(kept(monday.prototypes.lamps) == 1.0);
  CHECK(kept(monday.prototypes.cars) > 0.35);
  CHECK(kept(monday.prototypes.cars) < 0.65);
  CHECK(kept(monday.prototypes.bins) > 0.7);
  CHECK(kept(monday.prototypes.bins) < 1.0);
}

TEST_CASE("traffic drives, stops and never drives through a person") {
  const Town town = build_town(kSeed, 0);
  const double duration = 40.0;
  const RobotMotion robot(town.plan, 'A', kSeed, duration);
  const Actors actors = traffic_of(town, robot, duration);
  std::map<ActorKind, int> count;
  int stopped = 0;
  for (const Actor& actor : actors.actors()) {
    ++count[actor.kind];
    if (actor.kind == ActorKind::kPerson) continue;
    bool stood = false;
    for (std::size_t i = 1; i < actor.travelled.size(); ++i) {
      const double speed = (actor.travelled[i] - actor.travelled[i - 1]) / Actors::kTick;
      CHECK_FALSE(speed < -0.01);
      CHECK_FALSE(speed > 12.0);
      stood = stood || speed < 0.1;
    }
    stopped += stood ? 1 : 0;
  }
  CHECK(count[ActorKind::kCar] > 20);
  CHECK(count[ActorKind::kCyclist] > 3);
  CHECK(count[ActorKind::kPerson] > 100);
  CHECK(stopped > 5);

  const auto& all = actors.actors();
  for (std::size_t tick = 0; tick < all.front().travelled.size(); tick += 10) {
    std::vector<Vec2> vehicles;
    for (const Actor& actor : all) {
      if (actor.kind == ActorKind::kPerson) continue;
      vehicles.push_back(actor.path->at(actor.travelled[tick]));
    }
    const double t = Actors::kTick * static_cast<double>(tick) - Actors::kWarmUp;
    vehicles.push_back(robot.path().at(robot.travelled(t)));
    int overlapping = 0;
    for (std::size_t i = 0; i < vehicles.size(); ++i) {
      for (std::size_t k = 0; k < i; ++k) overlapping += norm(vehicles[i] - vehicles[k]) < 0.9;
    }
    CHECK_FALSE(overlapping > 0);
  }
}

TEST_CASE("a moving id lasts three seconds beyond the motion, then the standing id returns") {
  const Town town = build_town(kSeed, 0);
  const RobotMotion robot(town.plan, 'A', kSeed, 40.0);
  const Actors actors = traffic_of(town, robot, 40.0);
  const int window = static_cast<int>(3.0 / Actors::kTick);
  int checked_standing = 0;
  for (const Actor& actor : actors.actors()) {
    const int ticks = static_cast<int>(actor.travelled.size());
    for (int i = window + 1; i + window < ticks; i += 40) {
      bool moves = false;
      for (int k = i - window + 1; k < i + window - 1; ++k) {
        const auto at = static_cast<std::size_t>(k);
        const double step = actor.travelled[at] - actor.travelled[at - 1];
        moves = moves || step > 0.2 * Actors::kTick;
      }
      const bool marked = actor.moved[static_cast<std::size_t>(i)];
      if (moves) CHECK(marked);
      if (!marked) ++checked_standing;
    }
  }
  CHECK(checked_standing > 10);
}
