// Tests of the contents of a simulated recording.
#include "run_folder.hpp"
#include "src/core/quantile.hpp"
#include "src/simulator/town.hpp"
#include "tests/simulator/standing.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::simulator;
using namespace unimapper::simulator::test;

namespace {

constexpr std::uint64_t kSeed = 5;
constexpr std::uint32_t kScans = 60;

SimulationConfig recording_config() { return short_drive(SensorKind::kOs2_128, kScans, kSeed); }

/// Distance to the nearest standing surface along the six axes, at most `reach_m`.
std::vector<double> clearances(const Standing& standing, const std::vector<Vec3>& points,
                               double reach_m) {
  std::vector<std::pair<Vec3, Vec3>> ways;
  for (const Vec3& p : points) {
    for (const double d : {-reach_m, reach_m}) {
      for (const Vec3 way : {Vec3{d, 0, 0}, Vec3{0, d, 0}, Vec3{0, 0, d}}) {
        ways.emplace_back(p, p + way);
      }
    }
  }
  const std::vector<RayHit> hits = standing.between(ways);
  std::vector<double> nearest(points.size(), reach_m);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const double distance_m = hits[i].distance_m;
    if (distance_m >= 0.0) nearest[i / 6] = std::min(nearest[i / 6], distance_m);
  }
  return nearest;
}

}  // namespace

TEST_CASE("a recording is complete and looks like a town") {
  const Recording run(recording_config());
  REQUIRE(run.truth.size() == kScans);
  REQUIRE(run.odometry.size() == kScans);
  constexpr double kRays = 131072.0 / 16.0;
  std::map<int, double> share;
  double points = 0.0;
  double moving = 0.0;
  for (const auto& scan : run.scans) {
    // Sky, dark paint and glass give nothing back, most of the rest does.
    CHECK(static_cast<double>(scan.size()) > 0.7 * kRays);
    CHECK(static_cast<double>(scan.size()) < 0.985 * kRays);
    for (const LabelledPoint& p : scan) {
      const bool is_valid = std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) &&
                            p.intensity >= 0.0F && p.intensity <= 1.0F && p.label != 0;
      CHECK_FALSE(!is_valid);
      share[p.label] += 1.0;
      points += 1.0;
      moving += is_moving(p) ? 1.0 : 0.0;
      if (is_moving(p)) CHECK_FALSE(p.object == 0);
    }
  }
  for (auto& [label, count] : share) count /= points;
  CHECK(share[label::kRoad] > 0.05);
  CHECK(share[label::kSidewalk] > 0.02);
  CHECK(share[label::kBuilding] > 0.1);
  CHECK(share[label::kBuilding] < 0.65);
  CHECK(share[label::kVegetation] > 0.02);
  CHECK(share[label::kVegetation] < 0.4);
  CHECK(share[label::kCar] > 0.005);
  CHECK(share[label::kTrunk] > 0.0005);
  CHECK(share[label::kPole] > 0.0005);
  CHECK(share[label::kOutlier] < 1e-3);
  CHECK(moving / points > 0.002);
  CHECK(moving / points < 0.1);
}

TEST_CASE("static points lie on static geometry, moving ones do not, walls are centimetres thick") {
  const Recording run(recording_config());
  const Town town = build_town(kSeed, 0);
  const Standing scene(town);
  std::vector<Vec3> standing;
  std::vector<Vec3> walls;
  std::vector<Vec3> moving;
  for (std::size_t i = 0; i < kScans; i += 4) {
    for (const LabelledPoint& p : run.scans[i]) {
      if (norm(position(p)) > 50.0) continue;
      const Vec3 at = run.truth[i](position(p));
      // A standing person keeps the label person but is not part of the static geometry.
      if (is_moving(p)) {
        moving.push_back(at);
      } else if (p.label == label::kBuilding) {
        walls.push_back(at);
      } else if (p.label == label::kRoad || p.label == label::kSidewalk ||
                 p.label == label::kFence || p.label == label::kCar) {
        if (p.label != label::kCar || p.object < 20000) standing.push_back(at);
      }
    }
  }
  REQUIRE(standing.size() > 1000);
  REQUIRE(walls.size() > 1000);
  REQUIRE(moving.size() > 50);
  const auto share_near = [&](const std::vector<Vec3>& points) {
    const auto distances = clearances(scene, points, 0.25);
    const auto near =
        std::count_if(distances.begin(), distances.end(), [](double d) { return d < 0.2; });
    return static_cast<double>(near) / static_cast<double>(points.size());
  };
  CHECK(share_near(standing) > 0.97);
  CHECK(share_near(walls) > 0.97);
  CHECK(share_near(moving) < 0.6);
  std::vector<double> off_surface = clearances(scene, walls, 0.5);
  const double thickness = unimapper::median(std::span(off_surface));
  CHECK(thickness > 0.002);
  CHECK(thickness < 0.03);
}

TEST_CASE("scans agree with the true poses and slowly diverge with the odometry") {
  SimulationConfig config = recording_config();
  config.drift = DriftPreset::kBad;
  const Recording run(config);
  const Frame T_town_odometry = run.truth.front() * run.odometry.front().inverse();
  const auto error = [&](std::size_t i) {
    return norm((T_town_odometry * run.odometry[i]).origin - run.truth[i].origin);
  };
  CHECK(error(0) < 1e-5);
  CHECK(error(kScans - 1) > 0.02);
  CHECK(error(kScans - 1) < 5.0);
}

TEST_CASE("what stands in the scene is listed with its box") {
  const Recording run(recording_config());
  struct Box {
    int label;
    double x, y, z, yaw, length, width, height;
  };
  std::vector<Box> cars;
  std::ifstream file(run.folder / "objects.txt");
  std::string header;
  std::getline(file, header);
  for (Box b{}; file >> b.label >> b.x >> b.y >> b.z >> b.yaw >> b.length >> b.width >> b.height;) {
    if (b.label == label::kCar) cars.push_back(b);
  }
  CHECK(file.eof());
  REQUIRE(cars.size() > 20);
  std::size_t returns = 0;
  std::size_t listed = 0;
  for (std::size_t scan = 0; scan < run.scans.size(); ++scan) {
    for (const LabelledPoint& p : run.scans[scan]) {
      if (p.label != label::kCar || p.object >= 20000) continue;
      const Vec3 at = run.truth[scan](position(p));
      ++returns;
      listed += std::any_of(cars.begin(), cars.end(), [&](const Box& b) {
        const double c = std::cos(b.yaw);
        const double s = std::sin(b.yaw);
        const double u = c * (at.x - b.x) + s * (at.y - b.y);
        const double v = c * (at.y - b.y) - s * (at.x - b.x);
        // Noise, and the tilt of streets.
        return std::abs(u) < 0.5 * b.length + 0.15 && std::abs(v) < 0.5 * b.width + 0.15 &&
               std::abs(at.z - b.z) < 0.5 * b.height + 0.3;
      });
    }
  }
  REQUIRE(returns > 100);
  CHECK(static_cast<double>(listed) > 0.99 * static_cast<double>(returns));
}

TEST_CASE("what is labelled as moving moves within three seconds, and what moves is labelled so") {
  SimulationConfig config = recording_config();
  config.scene = "campus";
  const Recording run(config);
  std::map<int, std::vector<std::pair<int, int>>> motions;
  std::ifstream file(run.folder / "motion.txt");
  for (int object = 0, first = 0, last = 0; file >> object >> first >> last;) {
    CHECK(first <= last);
    CHECK(last < static_cast<int>(kScans));
    auto& stretches = motions[object];
    if (!stretches.empty()) CHECK(stretches.back().second + 1 < first);
    stretches.emplace_back(first, last);
  }
  REQUIRE(motions.size() > 20);
  int standing_but_labelled = 0;
  for (int scan = 0; scan < static_cast<int>(kScans); ++scan) {
    const auto moves_within = [&](int object, int margin) {
      const auto& stretches = motions[object];
      return std::any_of(stretches.begin(), stretches.end(), [&](const auto& stretch) {
        return stretch.first - margin <= scan && scan <= stretch.second + margin;
      });
    };
    for (const LabelledPoint& p : run.scans[static_cast<std::size_t>(scan)]) {
      if (p.object < 20000) continue;
      if (moves_within(p.object, 0)) {
        CHECK_FALSE(!is_moving(p));
      } else {
        // The first and the last three seconds have motion outside the recording.
        const bool is_inside = scan > 31 && scan + 31 < static_cast<int>(kScans);
        CHECK_FALSE((is_inside && is_moving(p) && !moves_within(p.object, 31)));
        standing_but_labelled += is_moving(p) ? 1 : 0;
      }
    }
  }
  CHECK(standing_but_labelled > 0);
}

TEST_CASE("stamps are ten a second and every sensor records") {
  const SensorKind sensor =
      GENERATE(SensorKind::kHdl64e, SensorKind::kVlp16, SensorKind::kOs1_64,
               SensorKind::kAevaAeries2, SensorKind::kLivoxAvia, SensorKind::kLivoxMid360);
  SimulationConfig config = recording_config();
  config.sensor = sensor;
  config.scans = 3;
  const Recording run(config);
  const SensorModel& model = sensor_model(sensor);
  INFO(model.name);
  for (const auto& scan : run.scans) {
    CHECK(static_cast<double>(scan.size()) > 0.25 * model.points_per_scan / config.thin);
    for (const LabelledPoint& p : scan) {
      CHECK_FALSE(norm(position(p)) > 1.02 * model.range_max_m);
    }
  }
  CHECK(run.bytes_of("times.txt") == "0.100000000\n0.200000000\n0.300000000\n");
}
