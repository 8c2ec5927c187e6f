// Fine cells of a keyframe: means, shared grids, rows
#include "src/onboard/keyframe/cell_table.hpp"

#include <bit>

#include "stages.hpp"
#include "tests/test.hpp"
#include "unimapper/core/owned.hpp"

using namespace unimapper;
using namespace unimapper::onboard;
using namespace unimapper::test;

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

TEST_CASE("vectors of every width find the same cells") {
  PipelineConfig config = small_config();
  config.keyframe.range_max_m = 20.0F;
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 1001; ++i) {  // the last batch is not full
    const auto f = static_cast<float>(i);
    points.emplace_back(0.03F * f * std::sin(0.01F * f), 8.0F * std::cos(0.017F * f),
                        3.0F * std::sin(0.3F * f));
    if (i % 100 == 7) points.back().y() = std::numeric_limits<float>::quiet_NaN();
  }
  Pose pose;
  pose.rotation = Eigen::AngleAxisd(0.3, Eigen::Vector3d(1.0, 2.0, 3.0).normalized()).matrix();
  pose.translation = {7.13, -3.77, 1.01};
  const auto found = [&](VectorWidth width) {
    ScanAccumulator scans;
    BlockWindow window;
    const MemoryBlock block = lay_out([&](Arena& arena) {
      scans.allocate(arena, config, width);
      scans.allocate_cells(arena, config);
      window.allocate(arena, config);
    });
    scans.begin(grid_near(pose.translation, config.voxel));
    window.begin(scans.grid());
    const ScanCounts counts = add_scan(scans, points, pose, window);
    CHECK(counts.not_finite == 10);
    CHECK(counts.out_of_range > 0);
    std::vector<std::uint32_t> words(scans.codes(0).begin(), scans.codes(0).end());
    for (const PointCode code : scans.codes(0)) {
      if (!has_cell(code)) continue;
      const CellSums& sums = scans.cells()[cell_of(code)];
      for (const float sum : {sums.x, sums.y, sums.z}) {
        words.push_back(std::bit_cast<std::uint32_t>(sum));
      }
    }
    return words;
  };
  const std::vector<std::uint32_t> baseline = found(VectorWidth::kBaseline);
  for (const VectorWidth width : {VectorWidth::kAvx2, VectorWidth::kAvx512}) {
    if (width <= widest_vectors()) CHECK(found(width) == baseline);
  }
}
