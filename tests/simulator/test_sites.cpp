// Tests of the scenes of one purpose: what each is made for is there.
#include <algorithm>
#include <catch2/catch.hpp>
#include <map>
#include <set>

#include "run_folder.hpp"
#include "src/simulator/raycast.hpp"
#include "src/simulator/scene.hpp"

namespace unimapper::simulator::test {
namespace {

std::unique_ptr<Scene> scene(const std::string& name, std::uint64_t seed, double duration_s = 30.0,
                             char route = 'A') {
  return make_scene(name, {seed, 0, route, duration_s});
}

/// What stands on the way of a ray; distance negative if nothing.
RayHit standing_hit(const StaticScene& standing, Vec3 from, Vec3 direction, double reach = 100.0) {
  const MovingScene nothing(standing);
  const Caster caster(standing, nothing);
  const RayQuery query{from, normalized(direction), 0.0F, 0.0F, static_cast<float>(reach)};
  RayHit hit{};
  caster.cast({&query, 1}, {&hit, 1});
  return hit;
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
  const StaticScene standing(deck->world());
  std::vector<double> clear;
  for (double t = 0.0; t < 30.0; t += 0.5) {
    const Frame sensor = deck->sensor_frame(t);
    const RayHit above = standing_hit(standing, sensor.origin, {0, 0, 1});
    const RayHit below = standing_hit(standing, sensor.origin, {0, 0, -1});
    REQUIRE(above.distance_m > 0.0F);
    REQUIRE(below.distance_m > 0.0F);
    CHECK(below.label == label::kParking);
    clear.push_back(above.distance_m + below.distance_m);
    for (const double turn : {0.0, 0.5, 1.0, 1.5}) {
      const RayHit around = standing_hit(standing, sensor.origin,
                                         {std::cos(turn * kPi), std::sin(turn * kPi), 0.0}, 60.0);
      CHECK_FALSE((around.distance_m >= 0.0F && around.distance_m < 1.2F));
    }
  }
  std::nth_element(clear.begin(), clear.begin() + 30, clear.end());
  CHECK(clear[30] > 2.3);
  CHECK(clear[30] < 3.6);
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

}  // namespace unimapper::simulator::test
