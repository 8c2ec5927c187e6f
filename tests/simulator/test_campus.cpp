// Tests of the campus: geometry, tours and crowd.
#include "run_folder.hpp"
#include "src/simulator/campus/campus.hpp"
#include "src/simulator/campus/crowd.hpp"
#include "tests/simulator/kept.hpp"
#include "tests/simulator/standing.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::simulator;
using namespace unimapper::simulator::test;

namespace {

using campus::Campus;
using campus::RobotWalk;

constexpr std::uint64_t kSeed = 3;
constexpr double kDuration = 60.0;

struct Built {
  explicit Built(std::uint64_t seed) : campus(campus::build_campus(seed, 0)) {}
  Campus campus;
  Standing standing{campus};
};

double whole_tour_s(const Campus& campus, char route) {
  return campus.plan.tour(route).length() / 1.2 + 60.0;
}

}  // namespace

TEST_CASE("a campus recording names its scene and has a campus's share of classes") {
  SimulationConfig config = short_drive(SensorKind::kOs1_64, 100, kSeed);
  config.scene = "campus";
  const Recording run(config);
  CHECK_THAT(run.bytes_of("dataset.json"), Catch::Contains("\"scene\": \"campus\""));
  std::map<int, double> share;
  double points = 0.0;
  double moving = 0.0;
  for (const auto& scan : run.scans) {
    for (const LabelledPoint& p : scan) {
      share[p.label] += 1.0;
      points += 1.0;
      moving += is_moving(p) ? 1.0 : 0.0;
      if (is_moving(p)) CHECK_FALSE(p.object == 0);
    }
  }
  for (auto& [label, count] : share) count /= points;
  CHECK(points / config.scans > 0.7 * 65536 / 16);
  CHECK(moving / points > 0.01);
  CHECK(moving / points < 0.15);
  CHECK(share[label::kPerson] > 0.001);  // some stand
  CHECK(share[label::kOtherGround] > 0.1);
  CHECK(share[label::kBuilding] > 0.1);
  CHECK(share[label::kVegetation] > 0.01);
  CHECK(share[label::kRoad] == 0.0);
  CHECK(share[252] == 0.0);  // no cars drive here
}

TEST_CASE(
    "the robot moves at walking pace, its sensor a metre above the ground, without collisions") {
  const std::uint64_t seed = GENERATE(std::uint64_t{1}, std::uint64_t{2}, kSeed);
  const Built built(seed);
  for (const char route : {'A', 'B', 'C'}) {
    const double duration = whole_tour_s(built.campus, route);
    const RobotWalk robot(built.campus.plan, route, seed, duration);
    CHECK(robot.travelled(duration) > built.campus.plan.tour(route).length());
    std::vector<std::pair<Vec3, Vec3>> downwards;
    std::vector<std::pair<Vec3, Vec3>> steps;
    for (double t = 0.0; t < duration; t += 0.2) {
      const Frame now = robot.sensor_frame(t);
      const Frame next = robot.sensor_frame(t + 0.2);
      CHECK_FALSE(robot.speed(t) > 1.45);
      CHECK_FALSE(robot.speed(t) < -1e-9);
      CHECK_FALSE(now.z.z < 0.97);
      CHECK_FALSE(norm(rotation_vector(now.inverse() * next)) / 0.2 > 1.2);  // rad/s
      downwards.emplace_back(now.origin, now.origin - Vec3{0, 0, 2.0});
      // The robot's own width, from knee height to above the sensor.
      if (norm(next.origin - now.origin) < 0.01) continue;
      for (const double side : {-0.35, 0.0, 0.35}) {
        for (const double up : {-0.6, 0.0, 0.5}) {
          steps.emplace_back(now({0, side, up}), next({0, side, up}));
        }
      }
    }
    INFO("route " << route << " seed " << seed);
    for (const RayHit& hit : built.standing.between(downwards)) {
      CHECK_FALSE(std::abs(hit.distance_m - RobotWalk::kSensorHeight) > 0.12);
    }
    for (const RayHit& hit : built.standing.between(steps)) CHECK_FALSE(hit.distance_m >= 0.0F);
  }
}

TEST_CASE("all tours start with a round over the plaza and come back to it; C runs against A, B") {
  const campus::Plan plan(kSeed);
  const auto plaza_share = [&](const RobotWalk& robot, double from_s, double to_s) {
    int inside = 0;
    int count = 0;
    for (double t = from_s; t < to_s; t += 0.5, ++count) {
      inside += plan.plaza().contains(robot.at(t)) ? 1 : 0;
    }
    return static_cast<double>(inside) / count;
  };
  const auto turn = [](const RobotWalk& robot) {
    double sum = 0.0;
    for (double t = 0.0; t < 45.0; t += 0.5) sum += cross(robot.at(t), robot.at(t + 0.5));
    return sum;
  };
  for (const char route : {'A', 'B', 'C'}) {
    const double round = plan.tour(route).length() / 1.1 + 60.0;
    const RobotWalk robot(plan, route, kSeed, round);
    CHECK(plaza_share(robot, 0.0, 40.0) > 0.99);
    CHECK(plaza_share(robot, 100.0, 140.0) < 0.7);
    CHECK(plaza_share(robot, round - 60.0, round) > 0.2);
    CHECK((turn(robot) > 0.0) == (route != 'C'));
  }
}

TEST_CASE("companions stay beside and behind the robot, a guide ahead, all others at a distance") {
  const Campus campus = campus::build_campus(kSeed, 0);
  const char route = GENERATE('A', 'B', 'C');
  const RobotWalk robot(campus.plan, route, kSeed, kDuration);
  const ActorSet crowd = campus::simulate_crowd(campus.plan, robot, kSeed, 0, kDuration);
  REQUIRE(crowd.actors.size() > 150);
  for (std::size_t i = 0; i < crowd.actors.size(); ++i) {
    const Actor& actor = crowd.actors[i];
    for (std::size_t tick = 160; Actors::time_of(tick) < kDuration; tick += 5) {
      const Frame sensor = robot.sensor_frame(Actors::time_of(tick));
      const Vec2 at = position(actor, tick);
      const Vec3 offset = sensor.rotate_back(Vec3{at.x, at.y, sensor.origin.z} - sensor.origin);
      const double distance = norm(Vec2{offset.x, offset.y});
      CHECK_FALSE(distance < 0.5);
      if (i == campus::kCompanions) CHECK_FALSE((distance < 3.0 || distance > 6.0));
      if (i == campus::kCompanions) CHECK_FALSE(offset.x < 1.0);
      if (i >= campus::kCompanions) continue;
      CHECK_FALSE(distance > 2.4);
      CHECK_FALSE(offset.x > 0.3);
    }
  }
}

TEST_CASE("no person walks through a wall or above the ground") {
  const std::uint64_t seed = GENERATE(range(1, 5));
  INFO("seed " << seed);
  const Built built(seed);
  const RobotWalk robot(built.campus.plan, 'A', seed, kDuration);
  const ActorSet crowd = campus::simulate_crowd(built.campus.plan, robot, seed, 0, kDuration);
  std::vector<std::pair<Vec3, Vec3>> steps;
  std::vector<std::pair<Vec3, Vec3>> downwards;
  for (const Actor& actor : crowd.actors) {
    for (std::size_t tick = 20; tick < actor.travelled.size(); tick += 20) {
      const Vec3 from = built.campus.plan.ground(position(actor, tick - 20), 1.2);
      const Vec3 to = built.campus.plan.ground(position(actor, tick), 1.2);
      downwards.emplace_back(to, to - Vec3{0, 0, 3.0});
      if (norm(to - from) > 0.01) steps.emplace_back(from, to);
    }
  }
  std::map<int, int> through;
  for (const RayHit& hit : built.standing.between(steps)) {
    if (hit.distance_m >= 0.0F) ++through[hit.label];
  }
  CHECK(through[label::kBuilding] == 0);
  CHECK(through[label::kFence] == 0);
  CHECK(through[label::kTrunk] == 0);
  CHECK(through[label::kPole] < 0.001 * static_cast<double>(steps.size()));
  int floating = 0;
  for (const RayHit& hit : built.standing.between(downwards)) {
    floating += std::abs(hit.distance_m - 1.2F) > 0.25F ? 1 : 0;
  }
  CHECK(floating < 0.01 * static_cast<double>(downwards.size()));
}

TEST_CASE("a crowd strolls, stands, stops and queues") {
  const Campus campus = campus::build_campus(kSeed, 0);
  const RobotWalk robot(campus.plan, 'A', kSeed, kDuration);
  const Actors actors(campus.prototypes, campus.plan,
                      campus::simulate_crowd(campus.plan, robot, kSeed, 0, kDuration));
  std::map<ActorKind, int> count;
  int always = 0;
  int never = 0;
  for (const Actor& actor : actors.actors()) {
    ++count[actor.kind];
    const auto moved = std::count(actor.moved.begin(), actor.moved.end(), true);
    never += moved == 0 ? 1 : 0;
    always += static_cast<std::size_t>(moved) == actor.moved.size() ? 1 : 0;
    for (std::size_t i = 1; i < actor.travelled.size(); ++i) {
      const double speed = (actor.travelled[i] - actor.travelled[i - 1]) / Actors::kTick;
      CHECK_FALSE(std::abs(speed) > 4.5);
    }
  }
  const int all = static_cast<int>(actors.actors().size());
  CHECK(count[ActorKind::kPerson] > 150);
  CHECK(count[ActorKind::kCyclist] > 3);
  CHECK(count[ActorKind::kVan] > 0);
  CHECK(count[ActorKind::kCar] == 0);
  CHECK(never > all / 20);
  CHECK(always > all / 4);
  CHECK(all - never - always > all / 20);
}

TEST_CASE("trees and lamps stay from day to day; bicycles and parked cars do not") {
  const Campus monday = campus::build_campus(kSeed, 0);
  const Campus tuesday = campus::build_campus(kSeed, 1);
  const auto kept = [&](PrototypeRange range) { return kept_share(monday, tuesday, range); };
  CHECK(kept(monday.prototypes.trees) == 1.0);
  CHECK(kept(monday.prototypes.hedges) == 1.0);
  CHECK(kept(monday.prototypes.bicycles) < 0.2);
  CHECK(kept(monday.prototypes.cars) > 0.2);
  CHECK(kept(monday.prototypes.cars) < 0.85);
}
