// Tests of the scenes that look alike elsewhere: the copy is exact, apart, and differs in what
// moves.
#include "src/simulator/displaced_scene.hpp"
#include "tests/simulator/standing.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::simulator;
using namespace unimapper::simulator::test;

namespace {

constexpr double kDuration = 20.0;

std::unique_ptr<Scene> scene(const std::string& name, std::uint64_t seed, char route) {
  const std::uint32_t day = static_cast<std::uint32_t>(route - 'A');
  return make_scene(name, {seed, day, route, kDuration});
}

/// Distances to what stands around, in directions given in the world's axes.
std::vector<RayHit> look(const Standing& standing, Vec3 from, const Frame& turned) {
  std::vector<std::pair<Vec3, Vec3>> ways;
  for (int elevation = -14; elevation <= 14; elevation += 4) {
    for (int azimuth = 0; azimuth < 360; azimuth += 6) {
      const double flat = std::cos(elevation * kDegree);
      const Vec3 direction{flat * std::cos(azimuth * kDegree), flat * std::sin(azimuth * kDegree),
                           std::sin(elevation * kDegree)};
      ways.emplace_back(from, from + 100.0 * turned.rotate(direction));
    }
  }
  return standing.between(ways);
}

/// Share of directions in which both see the same, within 2 cm.
double agreement(const std::vector<RayHit>& a, const std::vector<RayHit>& b) {
  std::size_t same = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (std::abs(a[i].distance_m - b[i].distance_m) < 0.02F) ++same;
  }
  return static_cast<double>(same) / static_cast<double>(a.size());
}

/// A scene and the one of route C, which looks alike.
struct Alike {
  std::unique_ptr<Scene> original;
  std::unique_ptr<Scene> copy;
  Standing here{original->world()};
  Standing there{copy->world()};
  Frame displaced = dynamic_cast<const DisplacedScene&>(*copy).T_world_scene();

  Alike(const std::string& name, std::uint64_t seed, char route = 'B')
      : original(scene(name, seed, route)), copy(scene(name, seed, 'C')) {}

  /// Of what is seen from a place of the original and from that of the copy.
  [[nodiscard]] double agreement_from(Vec3 from) const {
    return agreement(look(here, from, {}), look(there, displaced(from), displaced));
  }
};

double least_distance(const Scene& a, const Scene& b) {
  double least = 1e9;
  for (double t = 0.0; t <= kDuration; t += 0.25) {
    for (double u = 0.0; u <= kDuration; u += 0.25) {
      least = std::min(least, norm(a.sensor_frame(t).origin - b.sensor_frame(u).origin));
    }
  }
  return least;
}

}  // namespace

TEST_CASE("what stands in the copy is what stands in the original, but for what is parked") {
  const std::string name =
      GENERATE("bore", "fixtures", "decks", "streets", "corridor", "courtyard");
  const auto seed = GENERATE(1U, 2U);
  CAPTURE(name, seed);
  const Alike alike(name, seed);
  double sum = 0.0;
  int looks = 0;
  for (double t = 0.0; t <= kDuration; t += 2.0, ++looks) {
    sum += alike.agreement_from(alike.original->sensor_frame(t).origin);
  }
  const bool is_empty = name == "bore" || name == "fixtures";
  CHECK(sum / looks > (is_empty ? 0.995 : 0.75));
  if (!is_empty) CHECK(sum / looks < 1.0);
}

TEST_CASE("the first two routes overlap, the third is elsewhere, out of sight of both") {
  const std::string name =
      GENERATE("bore", "fixtures", "decks", "streets", "corridor", "courtyard", "quad", "orchard");
  const auto seed = GENERATE(1U, 2U, 3U);
  CAPTURE(name, seed);
  const auto a = scene(name, seed, 'A');
  const auto b = scene(name, seed, 'B');
  const auto c = scene(name, seed, 'C');
  CHECK(least_distance(*a, *b) < 2.0);
  CHECK(least_distance(*a, *c) > 2.5);
  CHECK(least_distance(*b, *c) > 2.5);
  for (double t = 0.0; t <= kDuration; t += 4.0) {
    const Frame sensor = c->sensor_frame(t);
    CHECK(dot(cross(sensor.x, sensor.y), sensor.z) == Approx(1.0));
    const Standing standing(c->world());
    const auto hits = look(standing, sensor.origin, sensor);
    const auto closed = std::count_if(hits.begin(), hits.end(),
                                      [](const RayHit& hit) { return hit.distance_m > 0.3F; });
    CHECK(closed > static_cast<std::ptrdiff_t>(0.6 * static_cast<double>(hits.size())));
  }
}

TEST_CASE("a tunnel with fixtures is the same again a period further") {
  const auto seed = GENERATE(1U, 3U, 4U);
  const auto tunnel = scene("fixtures", seed, 'A');
  const Standing standing(tunnel->world());
  const Frame sensor = tunnel->sensor_frame(0.0);
  // Periods turn about the middle of the circle; 25 m if the seed is odd.
  const double radius = std::hypot(sensor.origin.x, sensor.origin.y) - 1.9;
  double period = 0.0;  // the shortest: twice as far it is the same, too
  for (int bays = 10; bays < 80; ++bays) {
    const Frame turn = rotation_frame({0, 0, 2.0 * kPi / bays});
    const double same = agreement(look(standing, sensor.origin, sensor),
                                  look(standing, turn(sensor.origin), turn * sensor));
    if (same > 0.995) period = 2.0 * kPi * radius / bays;
  }
  CHECK(period > 14.9);
  CHECK(period < 35.1);
  if (seed % 2 == 1) CHECK(period == Approx(25.0).margin(0.1));
}

TEST_CASE("a bare bore is the same everywhere along it") {
  const auto bore = scene("bore", 1, 'A');
  const Standing standing(bore->world());
  const auto here = look(standing, bore->sensor_frame(0.0).origin, bore->sensor_frame(0.0));
  const Frame sensor = bore->sensor_frame(0.0);
  for (const double turned : {0.1, 0.5, 2.0}) {
    const Frame turn = rotation_frame({0, 0, turned});
    CHECK(agreement(here, look(standing, turn(sensor.origin), turn * sensor)) > 0.95);
  }
}

TEST_CASE("the copy of a courtyard is its mirror image, and its robot turns the other way") {
  const auto original = scene("courtyard", 1, 'B');
  const auto copy = scene("courtyard", 1, 'C');
  const auto turned = [](const Scene& visited) {
    double sum = 0.0;
    for (double t = 0.0; t < kDuration; t += 0.1) {
      const Frame before = visited.sensor_frame(t);
      const Frame after = visited.sensor_frame(t + 0.1);
      sum += cross(Vec2{before.x.x, before.x.y}, Vec2{after.x.x, after.x.y});
    }
    return sum;
  };
  CHECK(turned(*original) > 0.5);
  CHECK(turned(*copy) < -0.5);
}

TEST_CASE("the sides of a quad are equal but for its kiosk, which its copy lacks") {
  const Alike alike("quad", 1, 'A');
  const Vec3 middle{0.0, 0.0, 0.8};
  const auto seen = look(alike.here, middle, {});
  double least = 1.0;
  for (int side = 1; side < 4; ++side) {
    const Frame turn = rotation_frame({0, 0, 0.5 * kPi * side});
    least = std::min(least, agreement(seen, look(alike.here, middle, turn)));
  }
  CHECK(least > 0.8);
  CHECK(least < 0.99);
  CHECK(alike.agreement_from(middle) < 0.99);
}

TEST_CASE("an orchard lacks some of its trees, and the other one lacks others") {
  const Alike alike("orchard", 1);
  const double in_copy = alike.agreement_from(alike.original->sensor_frame(0.0).origin);
  CHECK(in_copy > 0.3);
  CHECK(in_copy < 0.9);
}
