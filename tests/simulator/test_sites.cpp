// Tests of the scenes of one purpose: what each is made for is there.
#include "run_folder.hpp"
#include "src/core/quantile.hpp"
#include "src/simulator/scene.hpp"
#include "tests/simulator/standing.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::simulator;
using namespace unimapper::simulator::test;

namespace {

std::unique_ptr<Scene> scene(const std::string& name, std::uint64_t seed, double duration_s = 30.0,
                             char route = 'A') {
  return make_scene(name, {seed, 0, route, duration_s});
}

/// Counts of labels near the robot over a visit, one per object, sampled every half second.
std::map<std::uint16_t, std::set<std::uint16_t>> objects_by_label(const Scene& scene,
                                                                  double duration_s, double near) {
  std::map<std::uint16_t, std::set<std::uint16_t>> objects;
  for (double t = 0.1; t < duration_s; t += 0.5) {
    const Vec3 at = scene.sensor_frame(t).origin;
    for (const MovingInstance& i : scene.during(t - 0.1, t, {at.x, at.y})) {
      if (norm(i.end.origin - at) < near) objects[i.label].insert(i.object);
    }
  }
  return objects;
}

constexpr std::uint16_t kMovingCar = 252, kMovingPerson = 254, kMovingTruck = 258;

}  // namespace

TEST_CASE("a parking deck has a ceiling above the robot, all the way, and walkers below it") {
  const auto seed = GENERATE(1U, 2U, 3U, 4U, 5U, 6U);
  const auto route = GENERATE('A', 'C');
  const auto deck = scene("deck", seed, 30.0, route);
  const Standing standing(deck->world());
  std::vector<double> clear;
  for (double t = 0.0; t < 30.0; t += 0.5) {
    const Frame sensor = deck->sensor_frame(t);
    const RayHit above = standing.towards(sensor.origin, {0, 0, 1});
    const RayHit below = standing.towards(sensor.origin, {0, 0, -1});
    REQUIRE(above.distance_m > 0.0F);
    REQUIRE(below.distance_m > 0.0F);
    CHECK(below.label == label::kParking);
    clear.push_back(above.distance_m + below.distance_m);
    for (const double turn : {0.0, 0.5, 1.0, 1.5}) {
      const RayHit around =
          standing.towards(sensor.origin, {std::cos(turn * kPi), std::sin(turn * kPi), 0.0}, 60.0);
      CHECK_FALSE((around.distance_m >= 0.0F && around.distance_m < 1.2F));
    }
  }
  const double clearance = unimapper::median(std::span(clear));
  CHECK(clearance > 2.3);
  CHECK(clearance < 3.6);
  const auto objects = objects_by_label(*deck, 30.0, 25.0);
  REQUIRE(objects.contains(kMovingPerson));
  CHECK(objects.at(kMovingPerson).size() >= 4);
}

TEST_CASE("some parking decks have a ramp, others are level") {
  int ramps = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const auto deck = scene("deck", seed, 60.0);
    double low = 1e9;
    double high = -1e9;
    for (double t = 0.0; t < 60.0; t += 1.0) {
      const double z = deck->sensor_frame(t).origin.z;
      low = std::min(low, z);
      high = std::max(high, z);
    }
    ramps += high - low > 1.0 ? 1 : 0;
    CHECK_FALSE((high - low > 0.1 && high - low < 1.0));
  }
  CHECK(ramps > 0);
  CHECK(ramps < 8);
}

TEST_CASE("a crowded square holds many people, and many of them stand before they walk") {
  const auto square = scene("square", GENERATE(1U, 2U, 3U), 30.0);
  const auto objects = objects_by_label(*square, 30.0, 40.0);
  REQUIRE(objects.contains(kMovingPerson));
  CHECK(objects.at(kMovingPerson).size() > 100);
  std::vector<double> stamps;
  for (int i = 1; i <= 300; ++i) stamps.push_back(0.1 * i);
  std::set<std::uint16_t> seen;
  int late = 0;
  for (const ObjectMotion& motion : square->motions(stamps)) {
    if (seen.insert(motion.object).second && motion.first_scan > 10) ++late;
  }
  CHECK(late > 25);
}

TEST_CASE("nobody walks into the robot on a square, a deck or in a hall") {
  const std::string name = GENERATE("square", "deck", "hall");
  const auto built = scene(name, 4, 30.0);
  for (double t = 0.1; t < 30.0; t += 0.1) {
    const Vec3 at = built->sensor_frame(t).origin;
    for (const MovingInstance& i : built->during(t - 0.1, t, {at.x, at.y})) {
      const Vec3 gap = i.end.origin - at;
      CHECK_FALSE(std::hypot(gap.x, gap.y) < 0.3);
    }
  }
}

TEST_CASE("a convoy stops for 3 to 20 s, goes on, and keeps its distances") {
  const auto seed = GENERATE(1U, 2U, 3U, 4U);
  const auto convoy = scene("convoy", seed, 60.0);
  double stood = 0.0;
  double moved = 0.0;
  double stop = 0.0;
  std::vector<double> stops;
  for (double t = 0.1; t < 60.0; t += 0.1) {
    const Vec3 before = convoy->sensor_frame(t - 0.1).origin;
    const Vec3 now = convoy->sensor_frame(t).origin;
    const bool stands = std::hypot(now.x - before.x, now.y - before.y) < 0.01;
    (stands ? stood : moved) += 0.1;
    if (!stands && stop > 0.5) stops.push_back(stop);
    stop = stands ? stop + 0.1 : 0.0;
    // The cars ahead and behind are the first two actors.
    for (const MovingInstance& i : convoy->during(t - 0.1, t, {now.x, now.y})) {
      if (i.object > 20001) continue;
      const double gap = std::hypot(i.end.origin.x - now.x, i.end.origin.y - now.y);
      CHECK_FALSE(gap < 6.0);
      CHECK_FALSE(gap > 30.0);
    }
  }
  CHECK(stood > 3.0);
  CHECK(moved > 15.0);
  REQUIRE_FALSE(stops.empty());
  for (const double seconds : stops) {
    CHECK(seconds > 2.5);
    CHECK(seconds < 21.0);
  }
}

TEST_CASE("a street has walkers beside walls that are seen for a second and a half") {
  const auto seed = GENERATE(1U, 2U, 3U, 4U);
  const double duration = 40.0;
  const auto street = scene("street", seed, duration);
  const Standing standing(street->world());
  struct Walker {
    double in_view_s = 0.0, moving_in_view_s = 0.0;
    double clearance = 10.0;
  };
  std::map<std::uint16_t, Walker> walkers;
  constexpr double kStep = 0.1;
  std::vector<double> speeds;
  for (double t = kStep; t < duration; t += kStep) {
    const Frame sensor = street->sensor_frame(t);
    speeds.push_back(norm(sensor.origin - street->sensor_frame(t - kStep).origin) / kStep);
    for (const MovingInstance& i :
         street->during(t - kStep, t, {sensor.origin.x, sensor.origin.y})) {
      if (i.label != kMovingPerson && i.label != label::kPerson) continue;
      const Vec3 chest = i.end.origin + Vec3{0, 0, 1.3};
      if (i.end.origin.z > 0.3) continue;  // a limb
      const double range = norm(chest - sensor.origin);
      if (range > 40.0) continue;
      const RayHit hit = standing.towards(sensor.origin, chest - sensor.origin, range);
      if (hit.distance_m >= 0.0F && hit.distance_m < range - 0.3) continue;
      Walker& walker = walkers[i.object];
      walker.in_view_s += kStep;
      if (norm(i.end.origin - i.begin.origin) > 0.02) walker.moving_in_view_s += kStep;
      for (const double side : {-1.0, 1.0}) {
        const RayHit wall = standing.towards(chest, {0, side, 0}, 3.0);
        if (wall.distance_m >= 0.0F) {
          walker.clearance = std::min(walker.clearance, static_cast<double>(wall.distance_m));
        }
      }
    }
  }
  REQUIRE(walkers.size() >= 6);
  int close = 0;
  int brief = 0;
  int in_motion = 0;
  for (const auto& [object, walker] : walkers) {
    CAPTURE(object, walker.in_view_s, walker.clearance);
    CHECK_FALSE(walker.clearance < 0.35);  // from the middle of the body
    close += walker.clearance < 0.85 ? 1 : 0;
    brief += walker.in_view_s > 0.7 && walker.in_view_s < 2.8 ? 1 : 0;
    in_motion += walker.moving_in_view_s > 0.7 * walker.in_view_s ? 1 : 0;
  }
  const auto count = static_cast<int>(walkers.size());
  CHECK(2 * close > count);  // beside a car the chest is above the bonnet
  CHECK(4 * brief > 3 * count);
  CHECK(4 * in_motion > 3 * count);
  const double speed = unimapper::median(std::span(speeds));
  CHECK(speed > 4.5);
  CHECK(speed < 8.5);
}

TEST_CASE("a street has parked trucks, passing vans and plants") {
  const auto street = scene("street", GENERATE(1U, 2U, 3U));
  const World& world = street->world();
  int trucks = 0;
  int plants = 0;
  const Prototypes& p = world.prototypes;
  for (const Instance& i : world.instances) {
    trucks += i.label == label::kTruck ? 1 : 0;
    plants += i.prototype < p.hedges.first + p.hedges.count ? 1 : 0;
  }
  CHECK(trucks >= 2);
  CHECK(plants > 10);
  CHECK(objects_by_label(*street, 30.0, 30.0).at(kMovingTruck).size() >= 2);
  const auto& surfaces = world.mesh.surfaces;
  CHECK(std::count(surfaces.begin(), surfaces.end(), Surface::kPoleMetal) >= 20 * 30);
}

TEST_CASE("tunnel and hall have walls and a ceiling all around the robot") {
  const std::string name = GENERATE("tunnel", "hall");
  const auto seed = GENERATE(1U, 2U, 3U);
  const auto route = GENERATE('A', 'B', 'C');
  const auto built = scene(name, seed, 20.0, route);
  const Standing standing(built->world());
  for (double t = 0.0; t < 20.0; t += 0.5) {
    const Frame sensor = built->sensor_frame(t);
    const RayHit above = standing.towards(sensor.origin, {0, 0, 1});
    const RayHit below = standing.towards(sensor.origin, {0, 0, -1});
    CHECK_FALSE(above.distance_m < 1.5F);
    CHECK_FALSE(above.distance_m > 8.0F);
    CHECK_FALSE(below.distance_m < 0.5F);
    CHECK_FALSE(below.distance_m > 2.5F);
    for (const double side : {-1.0, 1.0}) {
      const RayHit wall = standing.towards(sensor.origin, side * sensor.y);
      CHECK_FALSE(wall.distance_m < 0.5F);
      CHECK_FALSE(wall.distance_m > 40.0F);
    }
  }
  const auto objects = objects_by_label(*built, 20.0, 60.0);
  CHECK(objects.contains(name == "hall" ? kMovingPerson : kMovingCar));
}
