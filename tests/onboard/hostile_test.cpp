// Hostile scans: accounting of points by cause, bounded containers
//
// Every point is accounted for, every container stays within its capacity (which bounds the work),
// and the next ordinary keyframe is as it should be.
#include "hostile_scans.hpp"
#include "run.hpp"
#include "src/onboard/removal/tile_directory.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::test;
using hostile::Kind;
using unimapper::onboard::TileDirectory;

namespace {

PipelineConfig hostile_config() {
  PipelineConfig config = small_config();
  config.keyframe.max_points_per_scan = 20000;
  config.voxel.max_cells = 20000;
  config.voxel.max_voxels = 2000;
  config.voxel.max_window_blocks = 16384;
  return config;
}

/// A sensor at the origin of everything.
Pose at_origin() { return {}; }

/// What several hostile keyframes in a row came to. Scans are views into `scans`.
struct HostileRun {
  PipelineConfig config = hostile_config();
  std::vector<hostile::Points> scans;
  KeyframeStatistics last;
  std::vector<PointLabel> labels;  ///< of the last keyframe's first scan

  explicit HostileRun(Kind kind, const Pose& pose = at_origin()) {
    OwnedPipeline pipeline(config);
    for (std::size_t i = 0; i < config.keyframe.scans; ++i) {
      scans.push_back(hostile::scan(kind, config, i));
    }
    std::int64_t stamp = 0;
    for (int keyframe = 0; keyframe < 3; ++keyframe) {
      for (const hostile::Points& points : scans) {
        REQUIRE(pipeline->add_scan(view_of(points), pose, ++stamp).error.code == ErrorCode::kOk);
      }
      check(pipeline->keyframe(), *pipeline);
    }
    recover(*pipeline, pose, stamp);
  }

  [[nodiscard]] std::uint64_t dropped(DropCause cause) const { return last.dropped_by(cause); }
  [[nodiscard]] std::size_t points() const {
    std::size_t count = 0;
    for (const hostile::Points& scan : scans) count += scan.size();
    return count;
  }

 private:
  void check(const KeyframeView& view, const Pipeline& pipeline) {
    last = *view.statistics;
    CHECK(last.points_in == points());
    const std::uint64_t invalid = dropped(DropCause::kNotFinite) + dropped(DropCause::kOutOfRange);
    CHECK(last.points_valid + invalid + dropped(DropCause::kScanTooLarge) == last.points_in);
    CHECK(last.points_static + last.points_dynamic + invalid == last.points_in);
    // The other two say how much was asked for.
    for (const Capacity which : {Capacity::kCells, Capacity::kVoxels, Capacity::kPlaces}) {
      CHECK(use_of(view, which).used <= use_of(view, which).capacity);
    }
    CHECK(view.static_cells.size() + view.dynamic_cells.size() == last.cells);

    std::uint64_t counted[256] = {};
    for (std::size_t s = view.scans.size(); s-- > 0;) {
      labels.assign(scans[s].size(), static_cast<PointLabel>(99));
      REQUIRE(pipeline.labels(s, labels) == labels.size());
      for (const PointLabel label : labels) ++counted[static_cast<std::size_t>(label)];
    }
    CHECK(counted[static_cast<std::size_t>(PointLabel::kUnknown)] == invalid);
    CHECK(counted[static_cast<std::size_t>(PointLabel::kStatic)] == last.points_static);
    CHECK(counted[static_cast<std::size_t>(PointLabel::kDynamic)] == last.points_dynamic);
  }

  /// The next honest keyframe loses nothing.
  static void recover(Pipeline& pipeline, const Pose& pose, std::int64_t stamp) {
    hostile::Points wall;
    for (int i = 0; i < 5000; ++i) {
      wall.emplace_back(12.1F, 0.1F * static_cast<float>(i % 100) - 5.0F,
                        0.1F * static_cast<float>(i / 100) - 1.5F);
    }
    REQUIRE(pipeline.add_scan(view_of(wall), pose, ++stamp).error.code == ErrorCode::kOk);
    REQUIRE(pipeline.flush().keyframe_ready);
    const KeyframeStatistics& statistics = *pipeline.keyframe().statistics;
    for (const std::uint64_t dropped : statistics.dropped) CHECK(dropped == 0);
    CHECK(statistics.points_static + statistics.points_dynamic == wall.size());
  }
};

}  // namespace

TEST_CASE("hostile: all points in one cell make one cell") {
  const HostileRun run(Kind::kOneCell);
  CHECK(run.last.cells == 1);
  CHECK(run.last.points_valid == run.points());
  for (const std::uint64_t dropped : run.last.dropped) CHECK(dropped == 0);
}

TEST_CASE("hostile: cells for ten times the capacity are refused and counted point by point") {
  const HostileRun run(Kind::kOwnCells);
  REQUIRE(run.points() == 10 * std::size_t{run.config.voxel.max_cells});
  CHECK(run.last.cells == run.config.voxel.max_cells);
  CHECK(run.dropped(DropCause::kCellsFull) == run.points() - run.config.voxel.max_cells);
}

TEST_CASE("hostile: colliding keys are probed no further than the bound") {
  const HostileRun run(Kind::kCollidingKeys);
  // Tiles that hash to 64 neighbouring slots can fill those and what one probe sequence reaches.
  CHECK(run.last.cells <= 64 + TileDirectory::kMaxProbes);
  CHECK(run.last.cells >= TileDirectory::kMaxProbes);
  CHECK(run.dropped(DropCause::kCellsFull) > run.points() / 2);
  CHECK(run.last.points_dynamic == 0);
}

TEST_CASE("hostile: points beyond a scan's capacity are never looked at") {
  const HostileRun run(Kind::kTooMany);
  CHECK(run.points() == 100 * std::size_t{run.config.keyframe.max_points_per_scan});
  CHECK(run.dropped(DropCause::kScanTooLarge) == run.points() / 10 * 9);
  CHECK(run.last.points_valid == run.points() / 10);
}

TEST_CASE("hostile: a line has neither ground nor planes") {
  const HostileRun run(Kind::kLine);
  CHECK(run.last.points_valid == run.points());
  CHECK(run.last.ground_voxels == 0);
  CHECK(run.last.points_dynamic == 0);
}

TEST_CASE("hostile: a level plane is ground and nothing else") {
  const HostileRun run(Kind::kPlane);
  CHECK(run.dropped(DropCause::kNotFinite) == 0);
  CHECK(run.last.ground_voxels > 0);
  CHECK(run.last.points_dynamic == 0);
}

TEST_CASE("hostile: enormous coordinates are out of range, even far from the origin") {
  Pose far_away;
  far_away.translation = {9e7, -9e7, 9e7};
  for (const Pose& pose : {at_origin(), far_away}) {
    const HostileRun run(Kind::kEnormous, pose);
    CHECK(run.dropped(DropCause::kOutOfRange) == run.scans.size() * (run.scans[0].size() * 2 / 3));
    CHECK(run.last.points_valid > 0);
    CHECK(run.labels[1] == PointLabel::kUnknown);
  }
}

TEST_CASE("hostile: points that are not finite are skipped one by one") {
  const HostileRun run(Kind::kNotFinite);
  CHECK(run.dropped(DropCause::kNotFinite) > run.points() / 3 * 2 - 20);
  CHECK(run.dropped(DropCause::kNotFinite) <= run.points() / 3 * 2 + 20);
  CHECK(run.labels[0] != PointLabel::kUnknown);
  CHECK(run.labels[1] == PointLabel::kUnknown);
  CHECK(run.labels[2] == PointLabel::kUnknown);
}
