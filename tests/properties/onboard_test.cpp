// Sums of a pipeline's counts, whatever is dropped
#include "tests/random.hpp"
#include "tests/regression/tilted_town.hpp"
#include "tests/test.hpp"
#include "unimapper/onboard/owned_pipeline.hpp"

using namespace unimapper;
using namespace unimapper::regression;

namespace {

/// Small and smallest capacities, chosen by chance.
PipelineConfig random_capacities(test::Random& random) {
  PipelineConfig config = preset(random.below(2) == 0 ? SensorKind::kHdl64e : SensorKind::kOs1_64);
  config.keyframe.scans = 2 + random.below(4);
  config.free_space.images_per_keyframe = 2;
  config.keyframe.max_points_per_scan = 5000 + random.below(9000);
  config.keyframe.range_min_m = static_cast<float>(random.uniform(0.5, 6.0));
  config.keyframe.range_max_m = static_cast<float>(random.uniform(20.0, 60.0));
  config.keyframe.downsample_leaf_m = random.below(3) == 0 ? 0.2F : 0.0F;
  config.voxel.max_cells = 3000 + random.below(30000);
  config.voxel.max_voxels = 300 + random.below(2500);
  config.voxel.max_window_blocks = config.voxel.max_cells / 4 + random.below(3000);
  config.removal.window = 1 + random.below(6);
  config.removal.final_labels = random.below(2) == 0;
  config.loop_search.max_places = 3 + random.below(5);
  config.loop_search.max_bucket = 5 + random.below(200);
  config.search_scope.min_keyframe_gap = 1;
  return config;
}

std::uint64_t points_of(std::span<const FineCell> cells, bool ground_only = false) {
  std::uint64_t points = 0;
  for (const FineCell& cell : cells) points += !ground_only || cell.ground != 0 ? cell.points : 0U;
  return points;
}

}  // namespace

TEST_CASE("points in are static, dynamic or invalid, and every dropped one has one cause") {
  test::Random random(4);
  for (std::uint64_t round = 0; round < 6; ++round) {
    PipelineConfig config = random_capacities(random);
    if (round % 2 == 1) config.ground.foot_height_m = 0.0F;
    INFO("round " << round);
    OwnedPipeline pipeline(config);
    REQUIRE(pipeline);
    IntegerTown::Options options;
    options.seed = round;
    options.ground_points = 3000;
    options.points_per_block = 150;
    const IntegerTown town(options);
    // By scan index.
    std::vector<std::size_t> points;
    std::vector<std::uint64_t> not_finite;
    std::uint64_t keyframes = 0;
    std::uint64_t scans_in_keyframes = 0;
    std::uint64_t refused = 0;
    const auto look = [&] {
      const KeyframeView& view = pipeline->keyframe();
      const KeyframeStatistics& s = *view.statistics;
      CHECK(view.sequence == keyframes);
      ++keyframes;
      scans_in_keyframes += view.scans.size();
      std::uint64_t in = 0;
      std::uint64_t faulty = 0;
      std::uint64_t labelled[3] = {};
      std::uint64_t largest = 0;
      for (std::size_t k = 0; k < view.scans.size(); ++k) {
        const std::uint32_t index = view.scans[k].scan_index;
        in += points[index];
        faulty += not_finite[index];
        largest = std::max<std::uint64_t>(largest, points[index]);
        std::vector<PointLabel> labels(points[index] + 10);
        REQUIRE(pipeline->labels(k, labels) == points[index]);
        labels.resize(points[index]);
        for (const PointLabel label : labels) ++labelled[static_cast<int>(label)];
      }
      CHECK(s.points_in == in);
      CHECK(view.points_in == in);
      CHECK(view.points_dynamic == s.points_dynamic);
      CHECK(s.dropped_by(DropCause::kNotFinite) <= faulty);
      const std::uint64_t invalid =
          s.dropped_by(DropCause::kNotFinite) + s.dropped_by(DropCause::kOutOfRange);
      CHECK(in == s.points_valid + invalid + s.dropped_by(DropCause::kScanTooLarge));
      CHECK(in == s.points_static + s.points_dynamic + invalid);
      CHECK(labelled[static_cast<int>(PointLabel::kUnknown)] == invalid);
      CHECK(labelled[static_cast<int>(PointLabel::kStatic)] == s.points_static);
      CHECK(labelled[static_cast<int>(PointLabel::kDynamic)] == s.points_dynamic);
      CHECK(s.cells == view.static_cells.size() + view.dynamic_cells.size());
      CHECK(s.dynamic_cells == view.dynamic_cells.size());
      if (config.keyframe.downsample_leaf_m == 0.0F) {
        CHECK(points_of(view.static_cells) + points_of(view.dynamic_cells) +
                  s.dropped_by(DropCause::kCellsFull) ==
              s.points_valid);
        // Dynamic points lie in dynamic cells or, feet, in static ground cells below them.
        CHECK(points_of(view.dynamic_cells) + points_of(view.static_cells, true) >=
              s.points_dynamic);
        if (config.ground.foot_height_m == 0.0F) {
          CHECK(points_of(view.dynamic_cells) >= s.points_dynamic);
        }
      }
      CHECK(s.ground_voxels <= s.voxels);
      const auto use = [&](Capacity which) { return s.capacity[static_cast<std::size_t>(which)]; };
      CHECK(use(Capacity::kPointsPerScan).used == largest);
      CHECK(use(Capacity::kPointsPerScan).capacity == config.keyframe.max_points_per_scan);
      CHECK(use(Capacity::kCells).used == s.cells);
      CHECK(use(Capacity::kCells).capacity == config.voxel.max_cells);
      CHECK(use(Capacity::kVoxels).used == s.voxels);
      CHECK(use(Capacity::kVoxels).capacity == config.voxel.max_voxels);
      CHECK(use(Capacity::kPlaces).used ==
            std::min<std::uint64_t>(keyframes, config.loop_search.max_places));
      for (const Capacity c : {Capacity::kCells, Capacity::kVoxels, Capacity::kBlocks}) {
        CHECK(use(c).used <= use(c).capacity);
        CHECK(use(c).used > 0);
      }
      CHECK(pipeline->places().evicted() == keyframes - use(Capacity::kPlaces).used);
      CHECK((s.dropped_by(DropCause::kScanTooLarge) > 0) ==
            (largest > config.keyframe.max_points_per_scan));
      if (s.dropped_by(DropCause::kVoxelsFull) > 0) CHECK(s.voxels == config.voxel.max_voxels);
    };
    constexpr int kScans = 24;
    for (int i = 0; i < kScans; ++i) {
      TownScan scan = tilted().apply(town.scan(i));
      const std::size_t size = scan.xyz.size() / 3;
      std::uint64_t spoilt = 0;
      for (std::size_t k = random.below(50); k < size; k += 1 + random.below(400)) {
        scan.xyz[3 * k + random.below(3)] = std::numeric_limits<float>::quiet_NaN();
        ++spoilt;
      }
      std::int64_t stamp_ns = 1 + i * std::int64_t{100000000};
      if (random.below(8) == 0) stamp_ns = 0;
      points.push_back(size);
      not_finite.push_back(spoilt);
      const ScanResult result = pipeline->add_scan(scan.view(), scan.T_odometry_sensor, stamp_ns);
      refused += result.error.ok() ? 0 : 1;
      if (result.keyframe_ready) look();
    }
    if (pipeline->flush().keyframe_ready) look();
    CHECK(scans_in_keyframes + refused == kScans);
    CHECK(keyframes > 3);
  }
}
