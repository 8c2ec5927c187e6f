// Dynamic removal on small scenes, as a specification
#include "run.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::test;

namespace {

Pose stand_still(double) { return sensor_at(0.0, 0.0); }
Pose drive(double t) { return sensor_at(3.0 * t, 0.0); }

/// A street: walls on both sides, a parked car, a pole and `movers`.
Scene street(const std::vector<Box>& movers = {}) {
  Scene scene;
  scene.boxes = {standing_box({20.0, 12.0, 3.0}, {40.0, 0.3, 3.0}),
                 standing_box({20.0, -12.0, 3.0}, {40.0, 0.3, 3.0}),
                 standing_box({15.0, 6.0, 0.75}, {2.2, 0.9, 0.75}),
                 standing_box({10.0, -6.0, 2.0}, {0.1, 0.1, 2.0})};
  scene.boxes.insert(scene.boxes.end(), movers.begin(), movers.end());
  return scene;
}

Score total(const std::vector<KeyframeRun>& runs) {
  Score sum;
  for (const KeyframeRun& run : runs) sum += run.score;
  return sum;
}

/// Walks across the street.
Box walker(double x, double y, double speed_mps = 1.4) {
  return moving_box({x, y, 0.9}, {0.0, speed_mps, 0.0}, {0.25, 0.25, 0.9});
}

const Box kPassingCar = moving_box({-10.0, 3.5, 0.75}, {8.0, 0.0, 0.0}, {2.2, 0.9, 0.75});

/// Comes down from the sky at `t_s` and stays.
Box late_box(double t_s, double z, double half_height) {
  return {[=](double t) { return Eigen::Vector3d(12.0, 0.0, t < t_s ? 600.0 : z); },
          {1.0, 1.0, half_height}};
}

}  // namespace

TEST_CASE("a scene in which nothing moves loses nothing") {
  for (const auto& path : {stand_still, drive}) {
    const auto runs = run_scene(street(), small_config(), 40, path);
    REQUIRE(runs.size() == 4);
    // The roof of the parked car lies 0.3 m below the sensor: what passes over it at a grazing
    // angle is taken for having passed through it in one keyframe of the drive.
    for (const KeyframeRun& run : runs) CHECK(run.score.static_percent() > 99.7);
    CHECK(total(runs).static_percent() > 99.8);
  }
}

TEST_CASE("a walker in front of a wall is removed, the wall and the ground stay") {
  const auto runs = run_scene(street({walker(8.0, -3.0)}), small_config(), 40, stand_still);
  for (const KeyframeRun& run : runs) {
    CHECK(run.score.dynamic_percent() > 85.0);
    CHECK(run.score.static_percent() > 99.5);
  }
}

TEST_CASE("thin poles between the rays of few columns stay") {
  Scene scene = street();
  scene.columns = 256;
  for (double x = 9.0; x < 40.0; x += 5.0) {
    scene.boxes.push_back(standing_box({x, 4.0, 2.0}, {0.03, 0.03, 2.0}));
    scene.boxes.push_back(standing_box({x + 2.0, -4.5, 2.0}, {0.05, 0.05, 2.0}));
  }
  PipelineConfig config = small_config();
  const auto lost = [&] {
    return 100.0 - total(run_scene(scene, config, 40, drive)).static_percent();
  };
  const double with = lost();
  config.removal.pole_width_m = 0.0F;
  CHECK(with < 0.25 * lost());
  CHECK(with < 0.1);
}

TEST_CASE("own-keyframe evidence removes a mover from the very first keyframe") {
  const Scene scene = street({moving_box({6.0, -2.0, 0.75}, {3.0, 0.0, 0.0}, {2.0, 0.9, 0.75})});
  PipelineConfig config = small_config();
  const Score with = run_scene(scene, config, 10, stand_still).front().score;
  config.free_space.own_keyframe = false;
  const Score without = run_scene(scene, config, 10, stand_still).front().score;
  CHECK(with.dynamic_percent() > 80.0);
  CHECK(without.dynamic_right == 0);
}

TEST_CASE("a car that overtakes a parked one leaves it static") {
  const Score score = total(run_scene(street({kPassingCar}), small_config(), 60, stand_still));
  CHECK(score.dynamic_percent() > 85.0);
  CHECK(score.static_percent() > 99.0);
}

TEST_CASE("a car that has just stopped stays out of the map") {
  Box car = kPassingCar;
  car.center = [](double t) {
    return Eigen::Vector3d(-4.0 + 6.0 * std::min(t, 2.0), 3.0, 0.75);  // drives, then waits
  };
  PipelineConfig config = small_config();
  const auto last_percent = [&] {
    return run_scene(street({car}), config, 60, stand_still).back().score.dynamic_percent();
  };
  CHECK(last_percent() > 80.0);
  config.removal.persistence_share = 0.0F;
  CHECK(last_percent() < 20.0);
}

TEST_CASE("carrying sums on decides as the whole window does") {
  const Scene scene = street({walker(8.0, -3.0, 0.7), kPassingCar});
  for (const auto& path : {stand_still, drive}) {
    PipelineConfig config = small_config();
    REQUIRE(config.removal.log_odds_clamp > 0.0F);
    const Score carried = total(run_scene(scene, config, 80, path));
    config.removal.log_odds_clamp = 0.0F;
    const Score anew = total(run_scene(scene, config, 80, path));
    CHECK(carried.dynamic_percent() == Approx(anew.dynamic_percent()).margin(1.0));
    CHECK(carried.static_percent() == Approx(anew.static_percent()).margin(0.1));
  }
}

TEST_CASE("no position stays dynamic for longer than the log-odds clamp allows") {
  // A box comes down where every ray has passed for four seconds, and stays for good.
  PipelineConfig config = small_config();
  config.removal.persistence_share = 0.0F;
  config.removal.log_odds_clamp = 2.0F;
  const auto runs = run_scene(street({late_box(3.95, 0.75, 0.75)}), config, 100, stand_still);
  REQUIRE(runs.size() == 10);
  CHECK(runs[4].score.static_percent() < 99.5);
  // Each keyframe takes 0.425 for having observed it and 0.255 for each of two images off the sum.
  for (std::size_t k = 7; k < runs.size(); ++k) CHECK(runs[k].score.static_percent() > 99.8);
}

TEST_CASE("space that no ray has passed through is not free") {
  // A wall hides a parked car; then the sensor drives past the wall's end and sees it.
  Scene scene;
  scene.boxes = {standing_box({15.0, 5.0, 1.5}, {10.0, 0.2, 1.5}),
                 standing_box({22.0, 9.0, 0.75}, {2.2, 0.9, 0.75})};
  const auto runs =
      run_scene(scene, small_config(), 80, [](double t) { return sensor_at(5.0 * t, 0.0); });
  for (const KeyframeRun& run : runs) CHECK(run.score.static_percent() > 99.5);
}

TEST_CASE("a missing return is no evidence") {
  // Nothing behind the position where the box appears: no ray passed it and came back.
  Scene scene;
  scene.max_range = 30.0;
  scene.boxes = {late_box(1.95, 5.5, 2.5)};
  const auto runs = run_scene(scene, small_config(), 40, stand_still);
  for (const KeyframeRun& run : runs) CHECK(run.score.static_percent() > 99.9);
}

TEST_CASE("the paper's columns need history and ground, visibility needs neither") {
  const Scene scene = street({moving_box({6.0, -2.0, 0.9}, {0.0, 1.0, 0.0}, {0.3, 0.3, 0.9})});
  PipelineConfig paper = paper_preset(SensorKind::kHdl64e);
  const PipelineConfig small = small_config();
  paper.keyframe.max_points_per_scan = small.keyframe.max_points_per_scan;
  paper.voxel.max_cells = small.voxel.max_cells;
  paper.voxel.max_voxels = small.voxel.max_voxels;
  paper.loop_search.max_places = 20;
  const auto runs = run_scene(scene, paper, 40, stand_still);
  CHECK(runs.front().score.dynamic_right == 0);
  CHECK(runs.back().score.dynamic_percent() > 50.0);
  CHECK(runs.back().score.static_percent() > 98.0);
}

TEST_CASE("labels depend neither on where the odometry began nor on its heading") {
  const Scene scene = street({walker(16.0, -4.0)});
  const auto here = total(run_scene(scene, small_config(), 40, drive));
  Pose far;
  far.rotation = Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  far.translation = {50000.0, -50000.0, 300.0};
  const auto there = total(run_scene(scene, small_config(), 40, drive, far));
  REQUIRE(here.dynamic_points == there.dynamic_points);
  CHECK(there.dynamic_percent() == Approx(here.dynamic_percent()).margin(5.0));
  CHECK(there.static_percent() == Approx(here.static_percent()).margin(0.3));
  CHECK(there.dynamic_percent() > 80.0);
}

TEST_CASE("the static cells lie in the levelled frame of the reference scan") {
  const auto runs = run_scene(street(), small_config(), 10, stand_still, {});
  // The ground is 1.8 m below the sensor.
  std::size_t ground = 0;
  for (const FineCell& cell : runs.front().static_cells) {
    if (cell.ground == 0) continue;
    ++ground;
    CHECK(cell.position.z() == Approx(-1.8).margin(0.06));
  }
  CHECK(ground > 1000);
}

TEST_CASE("the same scans give the same bytes, twice in a row") {
  const Scene scene = street({walker(8.0, -4.0)});
  const auto first = run_scene(scene, small_config(), 30, drive);
  const auto second = run_scene(scene, small_config(), 30, drive);
  REQUIRE(first.size() == second.size());
  for (std::size_t k = 0; k < first.size(); ++k) {
    CHECK(first[k].labels == second[k].labels);
    REQUIRE(first[k].static_cells.size() == second[k].static_cells.size());
    CHECK(std::memcmp(first[k].static_cells.data(), second[k].static_cells.data(),
                      first[k].static_cells.size() * sizeof(FineCell)) == 0);
  }
}

TEST_CASE("points dropped by down-sampling are labelled like the ones that were kept") {
  PipelineConfig config = small_config();
  config.keyframe.downsample_leaf_m = 0.2F;
  const auto thinned = total(run_scene(street({walker(8.0, -4.0)}), config, 40, stand_still));
  CHECK(thinned.dynamic_percent() > 80.0);
  CHECK(thinned.static_percent() > 99.5);
}
