// Tests of the scan patterns against the sensors' data sheets.
#include "src/simulator/lidar.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::simulator;

namespace {

std::vector<PatternRay> pattern(SensorKind kind, double start_s = 0.0, std::uint32_t thin = 1) {
  std::vector<PatternRay> rays;
  make_pattern(kind, start_s, thin, rays);
  return rays;
}

double azimuth_deg(const PatternRay& ray) {
  return std::atan2(ray.direction.y, ray.direction.x) / kDegree;
}
double elevation_deg(const PatternRay& ray) { return std::asin(ray.direction.z) / kDegree; }

}  // namespace

TEST_CASE("every sensor shoots about as often as its data sheet says, inside its field of view") {
  for (const SensorModel& sensor : sensor_models()) {
    if (sensor.kind == SensorKind::kGeneric) continue;
    INFO(sensor.name);
    const auto rays = pattern(sensor.kind, 1.7);
    // A car-mounted Avia loses the shots at its own roof.
    const double share = sensor.kind == SensorKind::kLivoxAvia ? 0.75 : 0.99;
    const auto count = static_cast<double>(rays.size());
    CHECK(count >= share * sensor.points_per_scan);
    CHECK(count <= 1.001 * sensor.points_per_scan);
    const LidarModel model = lidar_model(sensor.kind);
    CHECK(model.range_max_m == Approx(sensor.range_max_m));
    CHECK(model.range_min_m == Approx(sensor.range_min_m));
    std::set<std::uint32_t> indices;
    for (const PatternRay& ray : rays) {
      CHECK_FALSE(std::abs(norm(ray.direction) - 1.0) > 1e-9);
      CHECK_FALSE(ray.time < 0.0F);
      CHECK_FALSE(ray.time > 1.0F);
      CHECK_FALSE(elevation_deg(ray) < sensor.elevation_min_deg - 2.5);
      CHECK_FALSE(elevation_deg(ray) > sensor.elevation_max_deg + 2.5);
      CHECK_FALSE(std::abs(azimuth_deg(ray)) > 0.5 * sensor.horizontal_fov_deg + 0.01);
      indices.insert(ray.index);
    }
    CHECK(indices.size() == rays.size());  // every ray has random numbers of its own
  }
}

TEST_CASE("Livox patterns do not repeat, spinning ones do") {
  const auto direction_sets_differ = [](SensorKind kind) {
    const auto first = pattern(kind, 0.0);
    const auto second = pattern(kind, 0.1);
    if (first.size() != second.size()) return true;
    std::size_t same = 0;
    for (std::size_t i = 0; i < first.size(); ++i) {
      same += norm(first[i].direction - second[i].direction) < 1e-3 ? 1 : 0;
    }
    return same < first.size() / 10;
  };
  CHECK(direction_sets_differ(SensorKind::kLivoxAvia));
  CHECK(direction_sets_differ(SensorKind::kLivoxMid360));
  CHECK_FALSE(direction_sets_differ(SensorKind::kOs2_128));
  CHECK_FALSE(repeats(SensorKind::kLivoxAvia));
  CHECK(repeats(SensorKind::kVlp16));
}

TEST_CASE("the Avia fills its field of view as sweeps accumulate") {
  std::set<std::pair<int, int>> one;
  std::set<std::pair<int, int>> ten;
  for (int sweep = 0; sweep < 10; ++sweep) {
    for (const PatternRay& ray : pattern(SensorKind::kLivoxAvia, 0.1 * sweep)) {
      const std::pair cell{static_cast<int>(std::floor(2 * azimuth_deg(ray))),
                           static_cast<int>(std::floor(2 * elevation_deg(ray)))};
      if (sweep == 0) one.insert(cell);
      ten.insert(cell);
    }
  }
  CHECK(2 * ten.size() > 3 * one.size());
}

TEST_CASE("thinning keeps every n-th column with the random numbers it had") {
  const auto all = pattern(SensorKind::kOs2_128);
  const auto some = pattern(SensorKind::kOs2_128, 0.0, 8);
  REQUIRE(some.size() == all.size() / 8);
  for (const PatternRay& ray : some) {
    CHECK_FALSE(norm(all[ray.index].direction - ray.direction) > 0.0);
  }
}

TEST_CASE("columns and rings can be set, and rings lie evenly in the sensor's field of view") {
  const SensorKind kind = GENERATE(SensorKind::kVlp16, SensorKind::kOs1_64, SensorKind::kHdl64e);
  const auto own = pattern(kind);
  const auto by_elevation = [](const PatternRay& a, const PatternRay& b) {
    return a.direction.z < b.direction.z;
  };
  const auto [lowest, highest] = std::minmax_element(own.begin(), own.end(), by_elevation);
  std::vector<PatternRay> rays;
  make_pattern(kind, 0.0, 1, rays, {512, 32, false});
  REQUIRE(rays.size() == 512 * 32);
  CHECK(elevation_deg(rays[0]) == Approx(elevation_deg(*highest)));
  CHECK(elevation_deg(rays[31]) == Approx(elevation_deg(*lowest)));
  const double gap = (elevation_deg(rays[0]) - elevation_deg(rays[31])) / 31.0;
  for (std::size_t i = 1; i < 32; ++i) {
    CHECK(elevation_deg(rays[i - 1]) - elevation_deg(rays[i]) == Approx(gap));
    CHECK_FALSE(rays[i].time < rays[i - 1].time);
  }
  CHECK_FALSE(rays.back().time > 1.0F);
}

TEST_CASE("uneven rings are three times as dense around the horizon as elsewhere") {
  std::vector<PatternRay> rays;
  make_pattern(SensorKind::kOs1_64, 0.0, 1, rays, {256, 64, true});
  REQUIRE(rays.size() == 256 * 64);
  CHECK(elevation_deg(rays[0]) == Approx(22.5));
  CHECK(elevation_deg(rays[63]) == Approx(-22.5));
  const auto gap = [&](std::size_t i) {
    return elevation_deg(rays[i]) - elevation_deg(rays[i + 1]);
  };
  CHECK(gap(2) == Approx(3.0 * gap(31)));
  CHECK(gap(60) == Approx(3.0 * gap(31)));
}

TEST_CASE("a spinning head turns clockwise and fires its lasers in time") {
  const auto rays = pattern(SensorKind::kVlp16);
  CHECK(elevation_deg(rays[0]) == Approx(-15.0));
  CHECK(elevation_deg(rays[1]) == Approx(1.0));
  CHECK(rays[16].time > rays[0].time);
  CHECK(rays[1].time > rays[0].time);
  CHECK(azimuth_deg(rays[160]) < azimuth_deg(rays[16]));
}
