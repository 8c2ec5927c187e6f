// Counts, capacities and reference scan of a keyframe
#include "stages.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::test;

namespace {

std::uint32_t ground_voxels(const PipelineConfig& config,
                            const std::vector<std::vector<Eigen::Vector3f>>& scans) {
  OwnedPipeline pipeline(config);
  REQUIRE(pipeline);
  std::int64_t stamp_ns = 0;
  for (const auto& points : scans) {
    REQUIRE(pipeline->add_scan(view_of(points), Pose{}, stamp_ns += kPeriodNs).keyframe_ready);
  }
  return pipeline->keyframe().statistics->ground_voxels;
}

}  // namespace

TEST_CASE("the scan in the middle is the reference, of an even number the later of two") {
  const std::vector<Eigen::Vector3f> points{{5.0F, 0.0F, 0.0F}};
  for (const std::uint32_t scans : {1U, 2U, 3U, 4U, 5U}) {
    INFO(scans << " scans");
    PipelineConfig config = small_config();
    config.keyframe.scans = 8;
    OwnedPipeline pipeline(config);
    for (std::uint32_t i = 0; i < scans; ++i) {
      Pose pose;
      pose.translation.x() = 0.25 * i;
      REQUIRE(pipeline->add_scan(view_of(points), pose, 1 + i * kPeriodNs).error.code ==
              ErrorCode::kOk);
    }
    REQUIRE(pipeline->flush().keyframe_ready);
    const KeyframeView& view = pipeline->keyframe();
    CHECK(view.reference_scan == scans / 2);
    CHECK(view.T_odometry_keyframe.translation.x() == 0.25 * (scans / 2));
  }
}

TEST_CASE("ground voxels are counted without those that are elevated") {
  const Cloud points =
      Cloud().floor(4.0F, 6.0F, 0.0F, 2.0F, -1.9F).floor(8.0F, 10.0F, 0.0F, 2.0F, -1.3F);
  PipelineConfig config = single_scans();
  CHECK(ground_voxels(config, {points}) == 1);
  config.ground.elevated_step_m = 0.0F;
  CHECK(ground_voxels(config, {points}) == 2);
}

TEST_CASE("ground voxels are counted without those that were seen through") {
  const std::vector<Eigen::Vector3f> wall = wall_ahead(-6.0F, 6.0F);
  const Cloud roof = Cloud().floor(6.0F, 8.0F, 0.0F, 2.0F, -0.3F);
  PipelineConfig config = single_scans();
  // A single observation may be a ray that grazed it.
  CHECK(ground_voxels(config, {wall, roof}) == 1);
  CHECK(ground_voxels(config, {wall, wall, roof}) == 0);
  config.ground.seen_through_share = 0.0F;
  CHECK(ground_voxels(config, {wall, wall, roof}) == 1);
}

TEST_CASE("the range of valid points includes both of its limits; others are counted and unknown") {
  PipelineConfig config = single_scans();
  config.keyframe.range_min_m = 2.0F;
  config.keyframe.range_max_m = 50.0F;
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const std::vector<Eigen::Vector3f> points{{2.0F, 0.0F, 0.0F},
                                            {50.0F, 0.0F, 0.0F},
                                            {std::nextafter(2.0F, 0.0F), 0.0F, 0.0F},
                                            {std::nextafter(50.0F, 60.0F), 0.0F, 0.0F},
                                            {0.0F, 0.0F, 0.0F},
                                            {1e30F, 1e30F, 1e30F},
                                            {std::nanf(""), 9.0F, 1.0F},
                                            {9.0F, kInfinity, 1.0F},
                                            {9.0F, 1.0F, -kInfinity}};
  OwnedPipeline pipeline(config);
  REQUIRE(pipeline->add_scan(view_of(points), Pose{}, 1).keyframe_ready);
  const KeyframeStatistics& statistics = *pipeline->keyframe().statistics;
  CHECK(statistics.points_valid == 2);
  CHECK(statistics.dropped_by(DropCause::kOutOfRange) == 4);
  CHECK(statistics.dropped_by(DropCause::kNotFinite) == 3);
  std::vector<PointLabel> labels(9);
  REQUIRE(pipeline->labels(0, labels) == 9);
  for (std::size_t i = 0; i < 9; ++i) {
    CHECK(labels[i] == (i < 2 ? PointLabel::kStatic : PointLabel::kUnknown));
  }
}

TEST_CASE("a scan that just fits is taken whole, of a larger one the first points") {
  PipelineConfig config = single_scans();
  config.keyframe.max_points_per_scan = 16;
  for (const std::size_t count : {std::size_t{16}, std::size_t{17}}) {
    OwnedPipeline pipeline(config);
    std::vector<Eigen::Vector3f> points;
    for (std::size_t i = 0; i < count; ++i) {
      points.emplace_back(5.0F + static_cast<float>(i), 0.0F, 0.0F);
    }
    REQUIRE(pipeline->add_scan(view_of(points), Pose{}, 1).keyframe_ready);
    const KeyframeStatistics& statistics = *pipeline->keyframe().statistics;
    CHECK(statistics.points_in == count);
    CHECK(statistics.points_valid == 16);
    CHECK(statistics.points_static == count);
    CHECK(statistics.cells == 16);
    CHECK(statistics.dropped_by(DropCause::kScanTooLarge) == count - 16);
    std::vector<PointLabel> labels(count);
    REQUIRE(pipeline->labels(0, labels) == count);
    CHECK(labels.back() == PointLabel::kStatic);
    CHECK(use_of(pipeline->keyframe(), Capacity::kPointsPerScan).used == count);
    CHECK(use_of(pipeline->keyframe(), Capacity::kPointsPerScan).capacity == 16);
  }
}

TEST_CASE("the counts of a keyframe are sums over its scans and begin anew with the next") {
  PipelineConfig config = small_config();
  config.keyframe.scans = 3;
  config.free_space.images_per_keyframe = 2;
  OwnedPipeline pipeline(config);
  const float nan = std::nanf("");
  const std::vector<std::vector<Eigen::Vector3f>> scans{
      {{5.1F, 0.1F, 0.1F}, {nan, 0.0F, 0.0F}},
      {{5.1F, 0.1F, 0.1F}, {9.1F, 0.1F, 0.1F}, {nan, 0.0F, 0.0F}, {1e5F, 0.0F, 0.0F}},
      {{9.1F, 0.1F, 0.1F}}};
  for (std::int64_t keyframe = 0; keyframe < 2; ++keyframe) {
    for (std::size_t i = 0; i < scans.size(); ++i) {
      const std::int64_t stamp_ns = 1 + (3 * keyframe + static_cast<std::int64_t>(i)) * kPeriodNs;
      REQUIRE(pipeline->add_scan(view_of(scans[i]), Pose{}, stamp_ns).keyframe_ready == (i == 2));
    }
    const KeyframeStatistics& statistics = *pipeline->keyframe().statistics;
    CHECK(pipeline->keyframe().sequence == static_cast<std::uint32_t>(keyframe));
    CHECK(statistics.points_in == 7);
    CHECK(pipeline->keyframe().points_in == 7);
    CHECK(statistics.points_valid == 4);
    CHECK(statistics.points_static == 4);
    CHECK(statistics.points_dynamic == 0);
    CHECK(statistics.dropped_by(DropCause::kNotFinite) == 2);
    CHECK(statistics.dropped_by(DropCause::kOutOfRange) == 1);
    CHECK(statistics.cells == 2);
    CHECK(statistics.dynamic_cells == 0);
    CHECK(statistics.voxels == 2);
    const auto use = [&](Capacity which) { return use_of(pipeline->keyframe(), which); };
    CHECK(use(Capacity::kPointsPerScan).used == 4);
    CHECK(use(Capacity::kCells).used == 2);
    CHECK(use(Capacity::kCells).capacity == config.voxel.max_cells);
    CHECK(use(Capacity::kVoxels).used == 2);
    CHECK(use(Capacity::kVoxels).capacity == config.voxel.max_voxels);
    CHECK(use(Capacity::kBlocks).used == 2);
    CHECK(use(Capacity::kPlaces).used == static_cast<std::uint64_t>(keyframe) + 1);
    CHECK(use(Capacity::kPlaces).capacity == config.loop_search.max_places);
  }
}

TEST_CASE("slips of the odometry add up from keyframe to keyframe, also over those that repeat") {
  PipelineConfig config = small_config();
  config.keyframe.scans = 2;
  config.removal.window = 1;
  config.deferred = GENERATE(false, true);
  OwnedPipeline pipeline(config);
  const std::vector<Eigen::Vector3f> points{{5.1F, 0.1F, 0.1F}};
  const Eigen::Matrix3d slip_m2 = Eigen::Vector3d(0.25, 0.0, 0.0).asDiagonal();
  const auto add = [&](std::int64_t scan, const Pose& pose) {
    const std::int64_t stamp_ns = 1 + scan * kPeriodNs;
    const ScanResult result = pipeline->add_scan(view_of(points), pose, stamp_ns);
    // Refused: what is told of the next scan holds until one is taken.
    CHECK(pipeline->add_scan(view_of(points), pose, stamp_ns).error.code ==
          ErrorCode::kTimeReversed);
    return result;
  };
  CHECK(pipeline->add_slip(Eigen::Matrix3d::Zero()));
  CHECK_FALSE(pipeline->add_slip(-slip_m2));
  Eigen::Matrix3d rounded = Eigen::Matrix3d::Zero();
  rounded(0, 1) = 1e-17;
  CHECK(OwnedPipeline(config)->add_slip(slip_m2 + rounded));
  CHECK_FALSE(pipeline->add_slip(slip_m2 * std::nan("")));
  std::vector<float> slips_m2;
  for (std::int64_t scan = 0; scan < 8; ++scan) {
    CHECK(pipeline->add_slip(slip_m2));
    const double moved_m = scan < 6 ? 0.0 : 3.0;
    ScanResult result = add(scan, {Eigen::Matrix3d::Identity(), {moved_m, 0.0, 0.0}});
    while (pipeline->work().work_left) {
    }
    if (result.keyframe_ready || config.deferred) {
      if (scan % 2 == 1 && !pipeline->keyframe().repeats) {
        slips_m2.push_back(pipeline->keyframe().slip(0, 0));
      }
    }
  }
  CHECK(slips_m2 == std::vector<float>{0.5F, 1.5F});
}

TEST_CASE("refused triangles are counted keyframe by keyframe") {
  // Standing still, every keyframe inserts the same triangles: beyond five of a kind none fits.
  Scene scene;
  for (int i = 0; i < 12; ++i) {
    const double bearing = 0.52 * i;
    const double range_m = 9.0 + 2.3 * (i % 5);
    scene.boxes.push_back(
        standing_box({range_m * std::cos(bearing), range_m * std::sin(bearing), 1.5},
                     {0.4 + 0.1 * (i % 3), 0.6, 1.5}));
  }
  PipelineConfig config = single_scans();
  config.loop_search.max_bucket = 5;
  OwnedPipeline pipeline(config);
  REQUIRE(pipeline);
  // The same insertions into a database of our own, which counts since its start.
  Owned<PlaceDatabase> places(config.loop_search, config.place_shape());
  const LabelledScan scan = scene.scan(sensor_at(0.0, 0.0), 0.0);
  std::uint64_t refused_before = 0;
  for (std::uint32_t i = 0; i < 8; ++i) {
    INFO("keyframe " << i);
    REQUIRE(pipeline->add_scan(scan.view(), sensor_at(0.0, 0.0), 1 + i * kPeriodNs).keyframe_ready);
    const KeyframeView& view = pipeline->keyframe();
    REQUIRE(view.place.keypoints.size() > 3);
    places->insert(view.place, {0, i}, view.T_odometry_keyframe);
    const std::uint64_t refused = places->dropped() - refused_before;
    refused_before = places->dropped();
    CHECK(view.statistics->dropped_by(DropCause::kTriangleTableFull) == refused);
    // Triangles alike within one place fill their buckets earlier.
    if (i >= 5) REQUIRE(refused > 0);
  }
}

TEST_CASE("dynamic points are counted with those of all scans that share their cells") {
  // The first keyframe saw through where a post of one cell then stands, in two scans.
  const std::vector<Eigen::Vector3f> wall = wall_ahead(-3.0F, 3.0F);
  PipelineConfig config = small_config();
  config.keyframe.scans = 2;
  config.removal.components = false;
  OwnedPipeline pipeline(config);
  std::int64_t stamp_ns = 0;
  for (int i = 0; i < 2; ++i) {
    (void)pipeline->add_scan(view_of(wall), Pose{}, stamp_ns += kPeriodNs);
  }
  REQUIRE(pipeline->keyframe().sequence == 0);
  const std::vector<std::vector<Eigen::Vector3f>> scans{
      {{6.1F, 0.1F, -0.5F}, {6.1F, 0.1F, -0.5F}, {-9.0F, 0.0F, 0.0F}},
      {{6.1F, 0.1F, -0.5F}, {-9.0F, 0.0F, 0.0F}, {1e5F, 0.0F, 0.0F}}};
  for (const auto& points : scans) {
    (void)pipeline->add_scan(view_of(points), Pose{}, stamp_ns += kPeriodNs);
  }
  const KeyframeView& view = pipeline->keyframe();
  REQUIRE(view.sequence == 1);
  CHECK(view.dynamic_cells.size() == 1);
  CHECK(view.statistics->dynamic_cells == 1);
  CHECK(view.statistics->points_dynamic == 3);
  CHECK(view.points_dynamic == 3);
  CHECK(view.statistics->points_static == 2);
  std::vector<PointLabel> labels(3);
  REQUIRE(pipeline->labels(1, labels) == 3);
  CHECK(labels ==
        std::vector<PointLabel>{PointLabel::kDynamic, PointLabel::kStatic, PointLabel::kUnknown});
}
