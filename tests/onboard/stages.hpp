// Stages of the pipeline up to the split of ground and obstacles, and small inputs for them
#pragma once

#include "run.hpp"
#include "src/onboard/keyframe/cell_table.hpp"
#include "src/onboard/keyframe/coarse_voxels.hpp"
#include "src/onboard/keyframe/scan_accumulator.hpp"
#include "src/onboard/removal/component_classifier.hpp"
#include "src/onboard/removal/evidence_window.hpp"
#include "src/onboard/removal/ground.hpp"
#include "src/onboard/removal/ground_levels.hpp"
#include "src/onboard/removal/stray_returns.hpp"
#include "src/onboard/removal/transparent_ground.hpp"
#include "tests/test.hpp"
#include "unimapper/core/owned.hpp"
#include "unimapper/free_space/range_image.hpp"

namespace unimapper::test {

using namespace unimapper::onboard;

/// Points every 5 cm on surfaces.
struct Cloud : std::vector<Eigen::Vector3f> {
  using std::vector<Eigen::Vector3f>::vector;

  /// A rectangle at height z, which rises along x from x = 0 on.
  Cloud& floor(float x0, float x1, float y0, float y1, float z, float slope = 0.0F) {
    for (float x = x0 + 0.025F; x < x1; x += 0.05F) {
      for (float y = y0 + 0.025F; y < y1; y += 0.05F) emplace_back(x, y, z + slope * x);
    }
    return *this;
  }
  Cloud& column(float x, float y, float z0, float z1) {
    for (float z = z0 + 0.025F; z < z1; z += 0.05F) emplace_back(x, y, z);
    return *this;
  }
  /// `count` points along x, as far apart as cells.
  Cloud& row(int count, float x = 0.1F, float y = 0.1F, float z = 3.1F) {
    for (int i = 0; i < count; ++i) emplace_back(x + 0.2F * static_cast<float>(i), y, z);
    return *this;
  }
  /// An obstacle of `wide` x `deep` columns, a cell apart.
  Cloud& block(float x, int wide, int deep, float z0, float z1) {
    for (int i = 0; i < wide; ++i) {
      for (int j = 0; j < deep; ++j) {
        column(x + 0.2F * static_cast<float>(i), 1.1F + 0.2F * static_cast<float>(j), z0, z1);
      }
    }
    return *this;
  }
};

/// Adds a scan in slices of 256 points.
inline ScanCounts add_scan(ScanAccumulator& scans, const std::vector<Eigen::Vector3f>& points,
                           const Pose& pose, BlockWindow& window) {
  scans.begin_scan(pose);
  while (scans.add_points(view_of(points), 256, window)) {
  }
  return scans.counts();
}

/// Stages with memory of their own, up to the split of ground and obstacles.
struct Stages {
  explicit Stages(const PipelineConfig& configuration = small_config())
      : config(configuration), block(lay_out([this](Arena& arena) { allocate(arena); })) {
    begin();
  }
  /// Up to the split of these points.
  explicit Stages(const Cloud& points, const PipelineConfig& configuration = small_config())
      : Stages(configuration) {
    take(points);
  }
  void allocate(Arena& arena) {
    scans.allocate(arena, config);
    scans.allocate_cells(arena, config);
    cells.allocate(arena, config.voxel);
    voxels.allocate(arena, config.voxel);
    transparent.allocate(arena, config);
    levels.allocate(arena, config);
    window.allocate(arena, config);
    components.allocate(arena, config);
    painter.allocate(arena, RangePainterConfig{.shape = config.free_space.image_shape(),
                                               .range_min_m = config.keyframe.range_min_m,
                                               .range_max_m = config.keyframe.range_max_m,
                                               .max_points = config.keyframe.max_points_per_scan});
  }
  void begin(const Eigen::Vector3d& at = Eigen::Vector3d::Zero()) {
    scans.begin(grid_near(at, config.voxel));
    window.begin(scans.grid());
  }
  ScanCounts add(const std::vector<Eigen::Vector3f>& points, const Pose& pose = {}) {
    return add_scan(scans, points, pose, window.blocks());
  }
  void build_cells() {
    window.blocks().arrange(scans.cells().occupied());
    cells.begin(scans.grid());
    cells.add(scans.cells(), window.blocks().order(), all_blocks());
  }
  [[nodiscard]] Slice all_blocks() const { return {0, scans.cells().block_count()}; }
  void build_voxels() {
    voxels.begin();
    voxels.add(cells, all_blocks());
    voxels.find_planes(cells.grid(), {0, voxels.map().size()});
  }
  std::uint32_t find_and_split_ground() {
    build_cells();
    build_voxels();
    const std::uint32_t ground = find_ground(config.voxel.coarse_size_m, sensor_m, voxels.map());
    rejected = levels.reject_elevated(voxels.map());
    propagate_ground(config.ground, voxels.map());
    split_ground(config.ground, config.removal, voxels, stray, all_blocks(), cells);
    return ground;
  }
  /// Adds a scan and splits it; returns the number of ground voxels.
  std::uint32_t take(const std::vector<Eigen::Vector3f>& points) {
    add(points);
    return find_and_split_ground();
  }
  /// Goes on to the next keyframe.
  void record_and_begin() {
    window.record(cells);
    begin();
  }
  /// Classifies components as if every dynamic cell had been seen through once, and every other one
  /// observed once before. Returns their number.
  std::uint32_t classify_components() {
    std::vector<std::int16_t> log_odds(cells.size(), -425);
    for (std::uint32_t row = 0; row < cells.size(); ++row) {
      if (cells.has(row, &CellMarks::dynamic)) log_odds[row] = 850;
    }
    return classify_components(log_odds);
  }
  /// The same with this evidence.
  std::uint32_t classify_components(const std::vector<std::int16_t>& log_odds) {
    components.begin();
    while (components.step(window.blocks(), log_odds, viewpoint, cells)) {
    }
    return components.components();
  }
  /// Row of the cell that holds a point; there must be one.
  std::uint32_t row_at(const Eigen::Vector3f& p) const {
    for (std::uint32_t row = 0; row < cells.size(); ++row) {
      if (cells.index(row) == voxel_index(p, 5.0F)) return row;
    }
    FAIL("no cell holds the point");
    return 0;
  }

  [[nodiscard]] bool has(const Eigen::Vector3f& p, CellMark mark) const {
    return cells.has(row_at(p), mark);
  }
  void set_rows(std::uint32_t count, CellMark mark) {
    for (std::uint32_t row = 0; row < count; ++row) cells.set(row, mark);
  }
  /// Marks a column of obstacle cells.
  void set_column(float x, float y, float z0, float z1, CellMark mark) {
    for (float z = z0; z < z1; z += 0.2F) cells.set(row_at({x, y, z}), mark);
  }
  [[nodiscard]] std::size_t dynamic_cells() const {
    std::size_t count = 0;
    for (std::uint32_t row = 0; row < cells.size(); ++row) {
      count += cells.has(row, &CellMarks::dynamic) ? 1 : 0;
    }
    return count;
  }

  PipelineConfig config;
  ScanAccumulator scans;
  CellTable cells;
  CoarseVoxels voxels;
  TransparentGround transparent;
  GroundLevels levels;
  std::uint32_t rejected = 0;  ///< elevated ground voxels
  EvidenceWindow window;
  ComponentClassifier components;
  Viewpoint viewpoint;
  Eigen::Vector3f sensor_m{0.0F, 0.0F, 20.0F};  ///< from the grid's origin: above everything
  StrayReturns stray;                           ///< none
  RangePainter painter;
  MemoryBlock block;
};

}  // namespace unimapper::test
