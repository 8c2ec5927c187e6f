// Ground: planes, elevated and transparent voxels, candidates above it
#include "src/onboard/removal/ground.hpp"

#include "stages.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::onboard;
using namespace unimapper::test;

TEST_CASE("flat and sloped floors are ground, walls and steep slopes are not") {
  const auto of_slope = [](float slope) {
    return Stages().take(Cloud().floor(2.0F, 4.0F, 0.0F, 2.0F, 0.5F, slope));
  };
  CHECK(of_slope(0.0F) == 1);
  CHECK(of_slope(0.3F) >= 1);
  CHECK(of_slope(1.0F) == 0);
  Cloud wall;
  for (float y = 0.0F; y < 2.0F; y += 0.05F) wall.column(3.0F, y, 0.0F, 2.0F);
  CHECK(Stages().take(wall) == 0);
}

TEST_CASE("a floor below snow is ground") {
  Cloud points;
  points.floor(0.0F, 2.0F, 0.0F, 2.0F, 0.1F);
  // One return in every ninth cell up to 2 m.
  for (int i = 0; i < 100; i += 3) {
    for (int z = 1; z < 10; z += 3) {
      points.emplace_back(0.1F + 0.2F * static_cast<float>(i / 10),
                          0.1F + 0.2F * static_cast<float>(i % 10),
                          0.1F + 0.2F * static_cast<float>(z));
    }
  }
  CHECK(Stages().take(points) == 1);
}

TEST_CASE("a roof above a floor is no ground") {
  Stages stages;
  CHECK(stages.take(
            Cloud().floor(0.0F, 2.0F, 0.0F, 2.0F, 0.1F).floor(0.0F, 2.0F, 0.0F, 2.0F, 4.1F)) == 1);
  CHECK(stages.has({1.0F, 1.0F, 0.1F}, &CellMarks::ground));
  CHECK_FALSE(stages.has({1.0F, 1.0F, 4.1F}, &CellMarks::ground));
}

TEST_CASE("a ceiling is no ground, though nothing was seen below it") {
  // Beside the robot, where a spinning LiDAR sees no floor; level, and in an odometry tilted by 8
  // degrees.
  const float slope = GENERATE(0.0F, 0.14F);
  const auto seen_from = [&](float sensor_z_m) {
    Stages stages;
    stages.sensor_m = {-3.0F, 1.0F, sensor_z_m};
    return stages.take(Cloud().floor(0.0F, 2.0F, 0.0F, 2.0F, 2.5F, slope));
  };
  CHECK(seen_from(1.0F) == 0);
  CHECK(seen_from(4.0F) == 1);
}

TEST_CASE("a road uphill is ground, and so is one whose plane is a little off") {
  struct Case {
    float away_m;
    float below_m;  ///< the sensor below the road's plane
    std::uint32_t ground;
  };
  // Three tenths of a metre and 3.5 cm for every metre.
  for (const Case& c : {Case{20.0F, -1.5F, 1}, Case{20.0F, 0.9F, 1}, Case{20.0F, 1.2F, 0},
                        Case{4.0F, 0.3F, 1}, Case{4.0F, 0.6F, 0}}) {
    INFO(c.away_m << " m away, " << c.below_m << " m below");
    constexpr float kSlope = 0.14F;
    Stages stages;
    stages.sensor_m = {1.0F - c.away_m, 1.0F, 1.0F - kSlope * c.away_m - c.below_m};
    CHECK(stages.take(Cloud().floor(0.0F, 2.0F, 0.0F, 2.0F, 1.0F - kSlope, kSlope)) == c.ground);
  }
}

TEST_CASE("ground a step above the ground around it is none, slopes and kerbs are") {
  struct Case {
    float x;         ///< where the second floor begins
    float height_m;  ///< of the second floor above the first
    float slope;
    std::uint32_t rejected;
  };
  const PipelineConfig config = small_config();
  REQUIRE(GroundConfig::kElevatedReachM == 10.0F);
  REQUIRE(config.voxel.coarse_size_m == 2.0F);
  REQUIRE(config.ground.elevated_step_m == 0.2F);
  for (const Case& c :
       {Case{4.0F, 0.6F, 0.0F, 1}, Case{4.0F, 0.15F, 0.0F, 0}, Case{4.0F, 0.0F, 0.25F, 0},
        Case{4.0F, 4.0F, 0.0F, 0},
        // Lower ground is looked for as far as configured: five voxels away, and six.
        Case{10.0F, 1.0F, 0.0F, 1}, Case{12.0F, 1.0F, 0.0F, 0},
        // 8 m apart: a fifth of a metre and 3.5 cm for every metre between them.
        Case{8.0F, 0.46F, 0.0F, 0}, Case{8.0F, 0.50F, 0.0F, 1}}) {
    INFO(c.x << " m away, " << c.height_m << " m above, slope " << c.slope);
    Stages stages;
    CHECK(stages.take(Cloud()
                          .floor(0.0F, 2.0F, 0.0F, 2.0F, 0.1F)
                          .floor(c.x, c.x + 2.0F, 0.0F, 2.0F, 0.1F + c.height_m - c.x * c.slope,
                                 c.slope)) == 2);
    CHECK(stages.rejected == c.rejected);
  }
}

TEST_CASE("objects on the ground are candidates, the ground is not") {
  Stages stages;
  REQUIRE(stages.take(Cloud().floor(0.0F, 4.0F, 0.0F, 4.0F, 0.02F).column(1.1F, 1.1F, 0.1F, 1.8F)) >
          0);
  CHECK(stages.has({3.1F, 3.1F, 0.02F}, &CellMarks::ground));
  for (const float z : {0.5F, 1.0F, 1.5F}) {
    CHECK(stages.has({1.1F, 1.1F, z}, &CellMarks::candidate));
    CHECK_FALSE(stages.has({1.1F, 1.1F, z}, &CellMarks::ground));
  }
}

TEST_CASE("with the paper's candidates, cells far from any ground are none") {
  PipelineConfig config = small_config();
  config.removal.candidates_next_to_ground = true;
  const Stages stages(Cloud().floor(0.0F, 4.0F, 0.0F, 4.0F, 0.02F).column(1.1F, 1.1F, 0.3F, 9.0F),
                      config);
  CHECK(stages.has({1.1F, 1.1F, 1.5F}, &CellMarks::candidate));
  CHECK(stages.has({1.1F, 1.1F, 3.5F}, &CellMarks::candidate));
  CHECK_FALSE(stages.has({1.1F, 1.1F, 7.5F}, &CellMarks::candidate));
}

TEST_CASE("ground that was seen through is none, whatever looks like it") {
  PipelineConfig config = small_config();
  config.free_space.own_keyframe = true;
  Stages stages(config);
  stages.add(Cloud().floor(6.0F, 8.0F, -1.0F, 1.0F, 0.1F));
  stages.build_cells();
  stages.build_voxels();
  const auto count = [&] {
    return find_ground(config.voxel.coarse_size_m, stages.sensor_m, stages.voxels.map());
  };
  REQUIRE(count() > 0);
  const auto reject = [&] {
    return stages.transparent.reject(stages.window, stages.cells, stages.voxels);
  };
  // Nothing is known yet.
  CHECK(reject() == 0);

  // Two scans of the keyframe saw a wall behind it: it had driven on.
  Cloud wall;
  for (float y = -6.0F; y < 6.0F; y += 0.05F) wall.column(15.0F, y, -3.0F, 3.0F);
  for (const std::uint32_t scan : {0U, 9U}) {
    stages.painter.paint(view_of(wall), stages.window.image_for(scan, Pose{})->pixels);
  }
  CHECK(reject() == count());
}

TEST_CASE("road below a non-planar voxel is found from the next planar voxel but one") {
  // What a van swept, four metres of it: road and sides.
  Cloud points;
  points.floor(0.0F, 6.0F, 0.0F, 2.0F, 0.05F);
  for (float x = 2.1F; x < 6.0F; x += 0.2F) {
    for (float y = 0.1F; y < 2.0F; y += 0.2F) points.column(x, y, 0.3F, 1.9F);
  }
  Stages stages;
  stages.config.ground.propagation_voxels = 1;
  REQUIRE(stages.take(points) > 0);
  CHECK(stages.has({3.1F, 1.1F, 0.05F}, &CellMarks::ground));
  CHECK_FALSE(stages.has({5.1F, 1.1F, 0.05F}, &CellMarks::ground));
  stages.config.ground.propagation_voxels = 2;
  stages.find_and_split_ground();
  CHECK(stages.has({5.1F, 1.1F, 0.05F}, &CellMarks::ground));
}
