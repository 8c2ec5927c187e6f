// Pipeline stages, each on an input small enough to work out by hand
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <memory>

#include "run.hpp"
#include "src/onboard/cell_table.hpp"
#include "src/onboard/coarse_voxels.hpp"
#include "src/onboard/component_classifier.hpp"
#include "src/onboard/evidence_window.hpp"
#include "src/onboard/ground.hpp"
#include "src/onboard/ground_levels.hpp"
#include "src/onboard/range_limit.hpp"
#include "src/onboard/scan_accumulator.hpp"
#include "src/onboard/transparent_ground.hpp"
#include "unimapper/core/angles.hpp"
#include "unimapper/free_space/free_columns.hpp"
#include "unimapper/free_space/range_image.hpp"

using namespace unimapper;
using namespace unimapper::onboard;
using namespace unimapper::test;

namespace {

/// Stages with memory of their own, up to the split of ground and obstacles.
struct Stages {
  explicit Stages(const PipelineConfig& configuration = small_config()) : config(configuration) {
    Arena measuring = Arena::measuring();
    allocate(measuring);
    block.resize(measuring.used() + 64);
    auto base = reinterpret_cast<std::uintptr_t>(block.data());
    base = (base + 63) / 64 * 64;
    Arena arena(reinterpret_cast<std::byte*>(base), measuring.used());
    allocate(arena);
    begin();
  }
  void allocate(Arena& arena) {
    scans.allocate(arena, config);
    cells.allocate(arena, config.voxel);
    voxels.allocate(arena, config.voxel);
    transparent.allocate(arena, config);
    levels.allocate(arena, config);
    columns.allocate(arena, 1000);
    window.allocate(arena, config);
    components.allocate(arena, config);
    painter.allocate(
        arena, RangePainterConfig{config.free_space.image_shape(), config.keyframe.range_min_m,
                                  config.keyframe.range_max_m, config.free_space.min_returns,
                                  config.keyframe.max_points_per_scan});
  }
  void begin(const Eigen::Vector3d& at = Eigen::Vector3d::Zero()) {
    scans.begin(grid_near(at, config.voxel));
    window.begin(scans.grid());
  }
  ScanCounts add(const std::vector<Eigen::Vector3f>& points, const Pose& pose = {}) {
    return scans.add(PointView::xyz(points.data(), points.size(), sizeof(points[0])), pose,
                     window.blocks());
  }
  void build_cells() {
    window.blocks().arrange(scans.cells().blocks());
    cells.build(scans.cells(), window.blocks().order(), scans.grid());
  }
  std::uint32_t find_and_split_ground() {
    build_cells();
    voxels.build(cells);
    const std::uint32_t ground =
        find_ground(config.ground, config.voxel.coarse_size_m, voxels.map());
    rejected = levels.reject_elevated(voxels.map());
    propagate_ground(config.ground, voxels.map());
    split_ground(config.ground, config.removal, voxels, cells);
    return ground;
  }
  /// Classifies components as if every dynamic cell had been seen through once, and every other one
  /// observed once before. Returns their number.
  std::uint32_t classify_components() {
    std::vector<std::int16_t> log_odds(cells.size(), -425);
    for (std::uint32_t row = 0; row < cells.size(); ++row) {
      if (cells.has(row, &CellMarks::dynamic)) log_odds[row] = 850;
    }
    return components.run(window.blocks(), log_odds, cells);
  }
  /// Row of the cell that holds a point; there must be one.
  std::uint32_t row_at(const Eigen::Vector3f& p) const {
    for (std::uint32_t row = 0; row < cells.size(); ++row) {
      if (cells.index(row) == voxel_index(p, 5.0F)) return row;
    }
    FAIL("no cell holds the point");
    return 0;
  }

  PipelineConfig config;
  std::vector<std::byte> block;
  ScanAccumulator scans;
  CellTable cells;
  CoarseVoxels voxels;
  TransparentGround transparent;
  GroundLevels levels;
  std::uint32_t rejected = 0;  ///< elevated ground voxels
  FreeColumns columns;
  EvidenceWindow window;
  ComponentClassifier components;
  RangePainter painter;
};

/// Points every 5 cm on a rectangle at height z.
void add_floor(std::vector<Eigen::Vector3f>& points, float x0, float x1, float y0, float y1,
               float z, float slope = 0.0F) {
  for (float x = x0 + 0.025F; x < x1; x += 0.05F) {
    for (float y = y0 + 0.025F; y < y1; y += 0.05F) points.emplace_back(x, y, z + slope * x);
  }
}

void add_column(std::vector<Eigen::Vector3f>& points, float x, float y, float z0, float z1) {
  for (float z = z0 + 0.025F; z < z1; z += 0.05F) points.emplace_back(x, y, z);
}

}  // namespace

TEST_CASE("the window of ten keyframes of the densest sensor fits 64 MB") {
  const PipelineConfig config = preset(SensorKind::kOs2_128);
  REQUIRE(config.removal.window == 10);
  Arena measuring = Arena::measuring();
  auto window = std::make_unique<EvidenceWindow>();
  window->allocate(measuring, config);
  CHECK(measuring.used() <= 64'000'000);
}

TEST_CASE("angles need no maths library") {
  for (double degrees = -180.0; degrees <= 180.0; degrees += 0.5) {
    CHECK(sin_deg(degrees) == Approx(std::sin(degrees * M_PI / 180.0)).margin(1e-10));
    const auto x = static_cast<float>(std::cos(degrees * M_PI / 180.0));
    const auto y = static_cast<float>(std::sin(degrees * M_PI / 180.0));
    const double turns = direction_turns(7.0F * x, 7.0F * y);
    CHECK(std::abs(std::remainder(turns - degrees / 360.0, 1.0)) < 1e-6);
  }
  CHECK(direction_turns(0.0F, 0.0F) == 0.0F);
}

TEST_CASE("a cell holds the mean of its points, far from the origin too") {
  for (const double offset : {0.0, 50000.0, -1234567.0}) {
    Stages stages;
    Pose pose;
    pose.translation = {offset, -offset, 0.0};
    stages.begin(pose.translation);
    stages.add({{1.09F, 1.09F, 1.09F}, {1.13F, 1.11F, 1.17F}}, pose);
    stages.build_cells();
    REQUIRE(stages.cells.size() == 1);
    CHECK(stages.cells.points(0) == 2);
    const Eigen::Vector3d mean =
        stages.cells.position(0).cast<double>() + stages.cells.grid().origin_m();
    CHECK(mean.x() - offset == Approx(1.11).margin(2e-4));
    CHECK(mean.y() + offset == Approx(1.10).margin(2e-4));
    CHECK(mean.z() == Approx(1.13).margin(2e-4));
  }
}

TEST_CASE("grids of different keyframes share their cells") {
  const VoxelConfig config;
  const Grid a = grid_near({0.0, 0.0, 0.0}, config);
  const Grid b = grid_near({50.0, -17.0, 3.0}, config);
  const GridShift shift = shift_between(a, b);
  REQUIRE(shift.representable);
  const Eigen::Vector3d point(47.31, -12.94, 1.07);
  const auto cell = [&](const Grid& grid) {
    return voxel_index((point - grid.origin_m()).cast<float>(), 5.0F);
  };
  const VoxelIndex in_a = cell(a);
  CHECK(VoxelIndex{in_a.x + shift.cells.x, in_a.y + shift.cells.y, in_a.z + shift.cells.z} ==
        cell(b));
  CHECK_FALSE(shift_between(a, grid_near({1e7, 0.0, 0.0}, config)).representable);
}

TEST_CASE("a table has one row per cell and finds each by its block") {
  Stages stages;
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 500; ++i) {
    const auto f = static_cast<float>(i);
    points.emplace_back(8.0F * std::sin(f), 8.0F * std::cos(1.7F * f), 3.0F * std::sin(0.3F * f));
  }
  stages.add(points);
  stages.build_cells();
  CHECK(stages.cells.size() == stages.scans.cells().size());
  for (std::uint32_t row = 0; row < stages.cells.size(); ++row) {
    const VoxelIndex index = stages.cells.index(row);
    const std::uint32_t block = stages.window.blocks().enter(block_of(index));
    REQUIRE(block < stages.cells.blocks().size());
    CHECK(row_of(stages.cells.blocks()[block], bit_of(index)) == row);
  }
}

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

TEST_CASE("what stands on the ground is a candidate, the ground is not") {
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

TEST_CASE("with the paper's candidates, what is far from any ground is none") {
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

TEST_CASE("columns are free from the ground up to the lowest obstacle") {
  Stages stages;
  std::vector<Eigen::Vector3f> points;
  add_floor(points, 0.0F, 4.0F, 0.0F, 4.0F, 0.02F);
  add_column(points, 1.1F, 1.1F, 1.4F, 1.8F);
  stages.add(points);
  stages.find_and_split_ground();
  stages.columns.build(stages.cells.blocks(),
                       [&](std::uint32_t b) { return stages.cells.marks(b).ground; });
  const auto free = [&](float x, float y, float z) {
    return stages.columns.is_free(voxel_index({x, y, z}, 5.0F));
  };
  CHECK(free(1.1F, 1.1F, 1.1F));          // under the obstacle
  CHECK_FALSE(free(1.1F, 1.1F, 1.5F));    // in it
  CHECK_FALSE(free(1.1F, 1.1F, 2.5F));    // above it: who knows
  CHECK(free(3.1F, 3.1F, 2.5F));          // nothing above the ground
  CHECK_FALSE(free(3.1F, 3.1F, 0.02F));   // the ground itself
  CHECK_FALSE(free(3.1F, 3.1F, -1.0F));   // below it
  CHECK_FALSE(free(30.0F, 30.0F, 1.0F));  // no ground seen there
}

TEST_CASE("a range image keeps the smallest range around each pixel and nothing elsewhere") {
  Stages stages;
  std::vector<Eigen::Vector3f> points;
  // A wall 10 m ahead, and nothing anywhere else.
  for (float y = -2.0F; y <= 2.0F; y += 0.02F) {
    for (float z = -1.0F; z <= 0.3F; z += 0.02F) points.emplace_back(10.0F, y, z);
  }
  points.emplace_back(5.0F, 0.0F, -0.1F);  // one nearer point
  RangeImage& image = *stages.window.image_for(0, Pose{});
  stages.painter.paint(PointView::xyz(points.data(), points.size(), sizeof(points[0])),
                       image.pixels);
  const auto seen_m = [&](float x, float y, float z) {
    std::int32_t pixel = 0;
    float range = 0.0F;
    stages.painter.projection().project(&x, &y, &z, 1, &pixel, &range);
    REQUIRE(pixel != ImageProjection::kOutside);
    return static_cast<float>(image.pixels[pixel]) / kRangeUnitsPerMetre;
  };
  CHECK(seen_m(3.0F, 0.3F, -0.1F) == Approx(10.0F).margin(0.1F));
  CHECK(seen_m(3.0F, 0.0F, -0.06F) == Approx(5.0F).margin(0.02F));
  CHECK(seen_m(-3.0F, 0.0F, -0.1F) == 0.0F);
  CHECK(seen_m(3.0F, 3.0F, -0.1F) == 0.0F);
}

TEST_CASE("directions outside the field of view have no pixel") {
  FreeSpaceConfig config;
  config.horizontal_fov_deg = 70.0F;
  config.elevation_min_deg = -20.0F;
  config.elevation_max_deg = 20.0F;
  const ImageProjection projection(config.image_shape());
  const float x[] = {1.0F, 1.0F, -1.0F, 1.0F, 1.0F, 0.0F, NAN};
  const float y[] = {0.0F, 1.0F, 0.0F, 0.0F, 0.0F, 0.0F, 1.0F};
  const float z[] = {0.0F, 0.0F, 0.0F, 0.5F, -0.5F, 0.0F, 0.0F};
  std::int32_t pixel[7];
  float range[7];
  projection.project(x, y, z, 7, pixel, range);
  CHECK(pixel[0] != ImageProjection::kOutside);
  for (const int i : {1, 2, 3, 4, 6}) CHECK(pixel[i] == ImageProjection::kOutside);
  for (const std::int32_t p : pixel) CHECK(p < static_cast<std::int32_t>(projection.pixels()));
}

TEST_CASE("a full turn has a pixel for every azimuth, the seam included") {
  const ImageProjection projection{FreeSpaceConfig{}.image_shape()};
  for (int i = 0; i <= 100000; ++i) {
    const auto angle = static_cast<float>(i * 2.0 * M_PI / 100000.0);
    const float x = std::cos(angle);
    const float y = std::sin(angle);
    const float z = 0.0F;
    std::int32_t pixel = 0;
    float range = 0.0F;
    projection.project(&x, &y, &z, 1, &pixel, &range);
    if (pixel < 0 || pixel >= static_cast<std::int32_t>(projection.pixels())) FAIL(i);
  }
}

TEST_CASE("the first and the last scan of a keyframe are painted, others evenly between") {
  for (const std::uint32_t images : {1U, 2U, 3U, 4U, 10U}) {
    PipelineConfig config = small_config();
    config.free_space.images_per_keyframe = images;
    Stages stages(config);
    std::vector<std::uint32_t> painted;
    for (std::uint32_t scan = 0; scan < 10; ++scan) {
      if (stages.window.image_for(scan, Pose{}) != nullptr) painted.push_back(scan);
    }
    REQUIRE(painted.size() == images);
    CHECK(painted.front() == 0);
    if (images > 1) CHECK(painted.back() == 9);
  }
}

TEST_CASE("when keyframes close by distance the latest scan is always painted") {
  PipelineConfig config = small_config();
  config.keyframe.distance_m = 5.0F;
  config.free_space.images_per_keyframe = 3;
  Stages stages(config);
  for (std::uint32_t scan = 0; scan < 10; ++scan) {
    CHECK(stages.window.image_for(scan, Pose{}) != nullptr);
    CHECK(stages.window.current().image_count <= 3);
  }
  CHECK(stages.window.current().image_count == 3);
}

TEST_CASE("obstacles that touch are one component, across block borders too") {
  Stages stages;
  std::vector<Eigen::Vector3f> points;
  // A staircase of cells that touch by their corners only, and one apart.
  for (int i = 0; i < 12; ++i) {
    const float at = 0.1F + 0.2F * static_cast<float>(i);
    points.emplace_back(at, at, 3.0F + at);
  }
  points.emplace_back(10.0F, 10.0F, 3.0F);
  stages.add(points);
  stages.find_and_split_ground();
  REQUIRE(stages.cells.size() == 13);
  // A third of the staircase is dynamic: enough for all of it.
  for (std::uint32_t row = 0; row < 4; ++row) stages.cells.set(row, &CellMarks::dynamic);
  CHECK(stages.classify_components() == 2);
  std::size_t dynamic = 0;
  for (std::uint32_t row = 0; row < 13; ++row) {
    dynamic += stages.cells.has(row, &CellMarks::dynamic) ? 1 : 0;
  }
  CHECK(dynamic == 12);
  CHECK_FALSE(stages.cells.has(stages.row_at({10.0F, 10.0F, 3.0F}), &CellMarks::dynamic));
}

TEST_CASE(
    "hardly dynamic components become static, confirmed static cells resist their component") {
  Stages stages;
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 40; ++i) points.emplace_back(0.1F + 0.2F * static_cast<float>(i), 0.1F, 3.1F);
  stages.add(points);
  stages.find_and_split_ground();
  stages.cells.set(0, &CellMarks::dynamic);
  stages.classify_components();
  CHECK_FALSE(stages.cells.has(0, &CellMarks::dynamic));

  for (std::uint32_t row = 0; row < 20; ++row) stages.cells.set(row, &CellMarks::dynamic);
  stages.cells.set(39, &CellMarks::confirmed_static);
  stages.classify_components();
  CHECK(stages.cells.has(38, &CellMarks::dynamic));
  CHECK_FALSE(stages.cells.has(39, &CellMarks::dynamic));
}

TEST_CASE("what little is known of a component outweighs what is not known of it") {
  Stages stages;
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 40; ++i) points.emplace_back(0.1F + 0.2F * static_cast<float>(i), 0.1F, 3.1F);
  stages.add(points);
  stages.find_and_split_ground();
  std::vector<std::int16_t> log_odds(stages.cells.size(), 0);
  for (std::uint32_t row = 0; row < 3; ++row) {
    log_odds[row] = 850;
    stages.cells.set(row, &CellMarks::dynamic);
  }
  stages.components.run(stages.window.blocks(), log_odds, stages.cells);
  CHECK(stages.cells.has(39, &CellMarks::dynamic));
}

TEST_CASE("ground that was seen through is none, whatever looks like it") {
  PipelineConfig config = small_config();
  config.free_space.own_keyframe = true;
  Stages stages(config);
  std::vector<Eigen::Vector3f> roof;
  add_floor(roof, 6.0F, 8.0F, -1.0F, 1.0F, 0.1F);
  stages.add(roof);
  stages.build_cells();
  stages.voxels.build(stages.cells);
  const auto count = [&] {
    return find_ground(config.ground, config.voxel.coarse_size_m, stages.voxels.map());
  };
  REQUIRE(count() > 0);
  const auto reject = [&] {
    return stages.transparent.reject(stages.window, stages.painter.projection(), stages.cells,
                                     stages.voxels);
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

TEST_CASE("road below what is not flat any more is found from the next flat voxel but one") {
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

TEST_CASE("low cells follow an obstacle but do not tie obstacles together") {
  Stages stages;
  std::vector<Eigen::Vector3f> points;
  add_floor(points, 0.0F, 4.0F, 0.0F, 4.0F, 0.02F);
  for (const float x : {1.1F, 2.5F}) add_column(points, x, 1.1F, 0.2F, 1.8F);
  for (float x = 1.1F; x < 2.5F; x += 0.1F) points.emplace_back(x, 1.1F, 0.25F);  // a low kerb
  stages.add(points);
  REQUIRE(stages.find_and_split_ground() > 0);
  for (float z = 0.5F; z < 1.8F; z += 0.2F) {
    stages.cells.set(stages.row_at({1.1F, 1.1F, z}), &CellMarks::dynamic);
  }
  stages.classify_components();
  const auto dynamic = [&](float x, float z) {
    return stages.cells.has(stages.row_at({x, 1.1F, z}), &CellMarks::dynamic);
  };
  CHECK(dynamic(1.1F, 1.5F));
  CHECK(dynamic(1.1F, 0.25F));
  CHECK_FALSE(dynamic(1.9F, 0.25F));
  CHECK_FALSE(dynamic(2.5F, 1.5F));
  CHECK_FALSE(dynamic(2.5F, 0.25F));
}

TEST_CASE("of the candidates the nearest are kept, in whole rings, as many as there is time for") {
  // Two cells in every ring of one metre, from the second ring on.
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 80; ++i) {
    points.emplace_back(0.5F * static_cast<float>(i) + 1.05F, 0.1F, 0.1F);
  }
  for (const std::uint32_t limit : {80U, 31U, 30U}) {
    Stages stages;
    stages.add(points);
    stages.build_cells();
    REQUIRE(stages.cells.size() == 80);
    for (std::uint32_t row = 0; row < 80; ++row) stages.cells.set(row, &CellMarks::candidate);
    const RangeLimit result = keep_nearest(stages.cells, Eigen::Vector3f::Zero(), 64.0F, limit);
    const std::uint32_t kept = limit == 80 ? 80 : 30;
    CHECK(result.kept == kept);
    CHECK(result.shed == 80 - kept);
    CHECK(result.range_m == (limit == 80 ? 0.0F : 16.0F));
    for (std::uint32_t row = 0; row < 80; ++row) {
      const bool near = stages.cells.position(row).norm() < 16.0F;
      CHECK(stages.cells.has(row, &CellMarks::candidate) == (limit == 80 || near));
    }
  }
}
