// Ground: planes, elevated and transparent voxels, candidates above it
#include "src/onboard/ground.hpp"

#include <catch2/catch.hpp>

#include "stages.hpp"

using namespace unimapper;
using namespace unimapper::onboard;
using namespace unimapper::test;

TEST_CASE("flat and sloped floors are ground, walls and steep slopes are not") {
  const auto ground_voxels = [](float slope) {
    Stages stages;
    std::vector<Eigen::Vector3f> points;
    add_floor(points, 2.0F, 4.0F, 0.0F, 2.0F, 0.5F, slope);
    stages.add(points);
    return stages.find_and_split_ground();
  };
  CHECK(ground_voxels(0.0F) == 1);
  CHECK(ground_voxels(0.3F) >= 1);
  CHECK(ground_voxels(1.0F) == 0);

  Stages wall;
  std::vector<Eigen::Vector3f> points;
  for (float y = 0.0F; y < 2.0F; y += 0.05F) add_column(points, 3.0F, y, 0.0F, 2.0F);
  wall.add(points);
  CHECK(wall.find_and_split_ground() == 0);
}

TEST_CASE("a floor below snow is ground") {
  Stages stages;
  std::vector<Eigen::Vector3f> points;
  add_floor(points, 0.0F, 2.0F, 0.0F, 2.0F, 0.1F);
  // One return in every ninth cell up to 2 m.
  for (int i = 0; i < 100; i += 3) {
    for (int z = 1; z < 10; z += 3) {
      points.emplace_back(0.1F + 0.2F * static_cast<float>(i / 10),
                          0.1F + 0.2F * static_cast<float>(i % 10),
                          0.1F + 0.2F * static_cast<float>(z));
    }
  }
  stages.add(points);
  CHECK(stages.find_and_split_ground() == 1);
}

TEST_CASE("a roof above a floor is no ground") {
  Stages stages;
  std::vector<Eigen::Vector3f> points;
  add_floor(points, 0.0F, 2.0F, 0.0F, 2.0F, 0.1F);
  add_floor(points, 0.0F, 2.0F, 0.0F, 2.0F, 4.1F);
  stages.add(points);
  CHECK(stages.find_and_split_ground() == 1);
  CHECK(stages.cells.has(stages.row_at({1.0F, 1.0F, 0.1F}), &CellMarks::ground));
  CHECK_FALSE(stages.cells.has(stages.row_at({1.0F, 1.0F, 4.1F}), &CellMarks::ground));
}

TEST_CASE("a ceiling is no ground, though nothing was seen below it") {
  // Beside the robot, where a spinning LiDAR sees no floor; level, and in an odometry tilted by 8
  // degrees.
  for (const float slope : {0.0F, 0.14F}) {
    INFO("slope " << slope);
    const auto ground_voxels = [slope](float sensor_z_m) {
      Stages stages;
      stages.sensor_m = {-3.0F, 1.0F, sensor_z_m};
      std::vector<Eigen::Vector3f> points;
      add_floor(points, 0.0F, 2.0F, 0.0F, 2.0F, 2.5F, slope);
      stages.add(points);
      return stages.find_and_split_ground();
    };
    CHECK(ground_voxels(1.0F) == 0);
    // The same surface from above.
    CHECK(ground_voxels(4.0F) == 1);
  }
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
    std::vector<Eigen::Vector3f> points;
    add_floor(points, 0.0F, 2.0F, 0.0F, 2.0F, 1.0F - kSlope, kSlope);
    stages.add(points);
    CHECK(stages.find_and_split_ground() == c.ground);
  }
}

TEST_CASE("ground a step above the ground around it is none, slopes and kerbs are") {
  struct Case {
    float height_m;  ///< of the second floor above the first
    float slope;
    std::uint32_t rejected;
  };
  for (const Case& c :
       {Case{0.6F, 0.0F, 1}, Case{0.15F, 0.0F, 0}, Case{0.0F, 0.25F, 0}, Case{4.0F, 0.0F, 0}}) {
    INFO(c.height_m << " m above, slope " << c.slope);
    Stages stages;
    std::vector<Eigen::Vector3f> points;
    add_floor(points, 0.0F, 2.0F, 0.0F, 2.0F, 0.1F);
    add_floor(points, 4.0F, 6.0F, 0.0F, 2.0F, 0.1F + c.height_m - 4.0F * c.slope, c.slope);
    stages.add(points);
    stages.find_and_split_ground();
    CHECK(stages.rejected == c.rejected);
  }
}

TEST_CASE("lower ground is looked for as far as configured") {
  // Five voxels from floor to floor, and six.
  for (const float x : {10.0F, 12.0F}) {
    Stages stages;
    REQUIRE(GroundConfig::kElevatedReachM == 10.0F);
    REQUIRE(stages.config.voxel.coarse_size_m == 2.0F);
    std::vector<Eigen::Vector3f> points;
    add_floor(points, 0.0F, 2.0F, 0.0F, 2.0F, 0.1F);
    add_floor(points, x, x + 2.0F, 0.0F, 2.0F, 1.1F);
    stages.add(points);
    CHECK(stages.find_and_split_ground() == 2);
    CHECK(stages.rejected == (x < 11.0F ? 1 : 0));
  }
}

TEST_CASE("the farther away lower ground is, the higher must the upper lie above it") {
  // 8 m apart: a fifth of a metre and 3.5 cm for every metre between them.
  for (const float height_m : {0.46F, 0.50F}) {
    Stages stages;
    REQUIRE(stages.config.ground.elevated_step_m == 0.2F);
    std::vector<Eigen::Vector3f> points;
    add_floor(points, 0.0F, 2.0F, 0.0F, 2.0F, 0.1F);
    add_floor(points, 8.0F, 10.0F, 0.0F, 2.0F, 0.1F + height_m);
    stages.add(points);
    CHECK(stages.find_and_split_ground() == 2);
    CHECK(stages.rejected == (height_m > 0.48F ? 1 : 0));
  }
}

TEST_CASE("objects on the ground are candidates, the ground is not") {
  Stages stages;
  std::vector<Eigen::Vector3f> points;
  add_floor(points, 0.0F, 4.0F, 0.0F, 4.0F, 0.02F);
  add_column(points, 1.1F, 1.1F, 0.1F, 1.8F);
  stages.add(points);
  REQUIRE(stages.find_and_split_ground() > 0);
  CHECK(stages.cells.has(stages.row_at({3.1F, 3.1F, 0.02F}), &CellMarks::ground));
  for (const float z : {0.5F, 1.0F, 1.5F}) {
    const std::uint32_t row = stages.row_at({1.1F, 1.1F, z});
    CHECK(stages.cells.has(row, &CellMarks::candidate));
    CHECK_FALSE(stages.cells.has(row, &CellMarks::ground));
  }
}

TEST_CASE("with the paper's candidates, cells far from any ground are none") {
  PipelineConfig config = small_config();
  config.removal.candidates_next_to_ground = true;
  Stages stages(config);
  std::vector<Eigen::Vector3f> points;
  add_floor(points, 0.0F, 4.0F, 0.0F, 4.0F, 0.02F);
  add_column(points, 1.1F, 1.1F, 0.3F, 9.0F);
  stages.add(points);
  stages.find_and_split_ground();
  CHECK(stages.cells.has(stages.row_at({1.1F, 1.1F, 1.5F}), &CellMarks::candidate));
  CHECK(stages.cells.has(stages.row_at({1.1F, 1.1F, 3.5F}), &CellMarks::candidate));
  CHECK_FALSE(stages.cells.has(stages.row_at({1.1F, 1.1F, 7.5F}), &CellMarks::candidate));
}

TEST_CASE("ground that was seen through is none, whatever looks like it") {
  PipelineConfig config = small_config();
  config.free_space.own_keyframe = true;
  Stages stages(config);
  std::vector<Eigen::Vector3f> roof;
  add_floor(roof, 6.0F, 8.0F, -1.0F, 1.0F, 0.1F);
  stages.add(roof);
  stages.build_cells();
  stages.build_voxels();
  const auto count = [&] {
    return find_ground(config.ground, config.voxel.coarse_size_m, stages.sensor_m,
                       stages.voxels.map());
  };
  REQUIRE(count() > 0);
  const auto reject = [&] {
    return stages.transparent.reject(stages.window, stages.cells, stages.voxels);
  };
  // Nothing is known yet.
  CHECK(reject() == 0);

  // Two scans of the keyframe saw a wall behind it: it had driven on.
  std::vector<Eigen::Vector3f> wall;
  for (float y = -6.0F; y < 6.0F; y += 0.05F) {
    for (float z = -3.0F; z < 3.0F; z += 0.05F) wall.emplace_back(15.0F, y, z);
  }
  for (const std::uint32_t scan : {0U, 9U}) {
    RangeImage& image = *stages.window.image_for(scan, Pose{});
    stages.painter.paint(PointView::xyz(wall.data(), wall.size(), sizeof(wall[0])), image.pixels);
  }
  CHECK(reject() == count());
}

TEST_CASE("road below a non-planar voxel is found from the next planar voxel but one") {
  PipelineConfig config = small_config();
  Stages stages(config);
  std::vector<Eigen::Vector3f> points;
  add_floor(points, 0.0F, 2.0F, 0.0F, 2.0F, 0.05F);
  // What a van swept, four metres of it: road and sides.
  add_floor(points, 2.0F, 6.0F, 0.0F, 2.0F, 0.05F);
  for (float x = 2.1F; x < 6.0F; x += 0.2F) {
    for (float y = 0.1F; y < 2.0F; y += 0.2F) add_column(points, x, y, 0.3F, 1.9F);
  }
  stages.add(points);
  const auto is_ground = [&](float x) {
    return stages.cells.has(stages.row_at({x, 1.1F, 0.05F}), &CellMarks::ground);
  };
  stages.config.ground.propagation_voxels = 1;
  REQUIRE(stages.find_and_split_ground() > 0);
  CHECK(is_ground(3.1F));
  CHECK_FALSE(is_ground(5.1F));
  stages.config.ground.propagation_voxels = 2;
  stages.find_and_split_ground();
  CHECK(is_ground(5.1F));
}
