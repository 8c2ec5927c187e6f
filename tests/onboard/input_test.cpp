// Bad input: refused or skipped, and counted
#include "run.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::test;
using Catch::Matchers::Contains;

namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr std::int64_t kHourNs = 3'600'000'000'000;

/// A pipeline that is given the same scan again and again.
struct Fed {
  explicit Fed(const PipelineConfig& config = small_config()) : pipeline(config) {
    REQUIRE(pipeline);
    Scene scene;
    scene.columns = 180;
    scene.boxes = {standing_box({8.0, 0.0, 1.5}, {0.3, 6.0, 1.5})};
    scan = scene.scan(sensor_at(0.0, 0.0), 0.0);
  }
  ScanResult result_at(double x, std::int64_t stamp_ns) {
    return pipeline->add_scan(scan.view(), sensor_at(x, 0), stamp_ns);
  }
  ErrorCode at(double x, std::int64_t stamp_ns) { return result_at(x, stamp_ns).error.code; }
  /// The next scan in time.
  ScanResult next_result(double x) { return result_at(x, last_ns += kPeriodNs); }
  ErrorCode next(double x) { return next_result(x).error.code; }
  /// Four scans from the origin on; their stamps are `from_ns` and later.
  void drive(std::int64_t from_ns) {
    for (int i = 0; i < 4; ++i) REQUIRE(at(0.1 * i, from_ns + i * kPeriodNs) == ErrorCode::kOk);
  }

  OwnedPipeline pipeline;
  LabelledScan scan;
  std::int64_t last_ns = 0;
};

/// Points in cells far from each other: a block for each of them.
std::vector<Eigen::Vector3f> scattered_points() {
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 400; ++i) {
    points.emplace_back(2.0F * static_cast<float>(i % 20) - 19.0F,
                        2.0F * static_cast<float>(i / 20) - 19.0F, 2.0F);
  }
  return points;
}

}  // namespace

TEST_CASE("a scan without a single valid point is refused and leaves no trace") {
  Fed fed;
  const std::vector<Eigen::Vector3f> bad(10, {kNan, kNan, kNan});
  CHECK(fed.pipeline->add_scan(view_of({}), sensor_at(0, 0), 1).error.code ==
        ErrorCode::kEmptyScan);
  CHECK_FALSE(fed.pipeline->flush().keyframe_ready);
  REQUIRE(fed.at(0, 2) == ErrorCode::kOk);
  const ScanResult refused = fed.pipeline->add_scan(view_of(bad), sensor_at(0, 0), 3);
  CHECK(refused.error.code == ErrorCode::kEmptyScan);
  CHECK_THAT(refused.error.message, Contains("no point"));
  // The refused stamp does not count.
  CHECK(fed.at(0, 3) == ErrorCode::kOk);
  REQUIRE(fed.pipeline->flush().keyframe_ready);
  CHECK(fed.pipeline->keyframe().scans.size() == 2);
  CHECK(fed.pipeline->keyframe().scans[1].scan_index == 3);
}

TEST_CASE("a pose that is no pose is refused with a reason") {
  Fed fed;
  Pose nan = sensor_at(0, 0);
  nan.translation.y() = std::numeric_limits<double>::quiet_NaN();
  Pose scaled = sensor_at(0, 0);
  scaled.rotation *= 2.0;
  for (const Pose& pose : {nan, scaled, sensor_at(1e15, 0)}) {
    const ScanResult result = fed.pipeline->add_scan(fed.scan.view(), pose, 1);
    CHECK(result.error.code == ErrorCode::kInvalidPose);
    CHECK_THAT(result.error.message, Contains("pose"));
  }
  CHECK(fed.at(0, 1) == ErrorCode::kOk);
}

TEST_CASE("stamps from the past that do not increase never set the clock back") {
  Fed fed;
  const auto add = [&](std::int64_t stamp_ns) { return fed.at(0, stamp_ns); };
  REQUIRE(add(100 * kPeriodNs) == ErrorCode::kOk);
  for (int i = 0; i < 5; ++i) CHECK(add(50 * kPeriodNs) == ErrorCode::kTimeReversed);
  for (int i = 0; i < 5; ++i) CHECK(add((49 - i) * kPeriodNs) == ErrorCode::kTimeReversed);
  CHECK(add(101 * kPeriodNs) == ErrorCode::kOk);
  CHECK(add(101 * kPeriodNs) == ErrorCode::kTimeReversed);
  CHECK(add(101 * kPeriodNs - 1) == ErrorCode::kTimeReversed);
  CHECK(add(101 * kPeriodNs + 1) == ErrorCode::kOk);
  // Late scans one at a time are no clock that was set.
  for (int i = 0; i < 5; ++i) {
    CHECK(add((60 + i) * kPeriodNs) == ErrorCode::kTimeReversed);
    CHECK(add((102 + i) * kPeriodNs) == ErrorCode::kOk);
  }
}

TEST_CASE("a clock that is set back costs two scans") {
  Fed fed;
  fed.drive(2 * kHourNs);
  const auto add = [&](int i) { return fed.result_at(0.1 * i, kHourNs + i * kPeriodNs); };
  const ScanResult first = add(4);
  CHECK(first.error.code == ErrorCode::kTimeReversed);
  CHECK_FALSE(first.keyframe_ready);
  const ScanResult second = add(5);
  CHECK(second.error.code == ErrorCode::kTimeJump);
  CHECK_THAT(second.error.message, Contains("clock"));
  // Scans of both times do not share a keyframe.
  REQUIRE(second.keyframe_ready);
  CHECK(fed.pipeline->keyframe().scans.size() == 4);
  for (int i = 6; i < 12; ++i) CHECK(add(i).error.code == ErrorCode::kOk);
  REQUIRE(fed.pipeline->flush().keyframe_ready);
  CHECK(fed.pipeline->keyframe().scans.size() == 6);
}

TEST_CASE("one stamp from far in the future costs one scan") {
  Fed fed;
  fed.drive(0);
  CHECK(fed.at(0.4, kHourNs) == ErrorCode::kTimeJump);
  CHECK(fed.at(0.5, 5 * kPeriodNs) == ErrorCode::kOk);
  CHECK(fed.at(0.6, std::numeric_limits<std::int64_t>::max() - kHourNs) == ErrorCode::kTimeJump);
  CHECK(fed.at(0.7, 7 * kPeriodNs) == ErrorCode::kOk);
}

TEST_CASE("a clock that is set ahead costs one scan") {
  Fed fed;
  fed.drive(0);
  const ScanResult jump = fed.result_at(0.4, kHourNs + 4 * kPeriodNs);
  CHECK(jump.error.code == ErrorCode::kTimeJump);
  CHECK(jump.keyframe_ready);
  for (int i = 5; i < 9; ++i) CHECK(fed.at(0.1 * i, kHourNs + i * kPeriodNs) == ErrorCode::kOk);
}

TEST_CASE("a clock that is set back while the odometry jumps is followed as well") {
  Fed fed;
  for (int i = 0; i < 4; ++i) REQUIRE(fed.at(500.0, kHourNs + i * kPeriodNs) == ErrorCode::kOk);
  CHECK(fed.at(0.0, 1 * kPeriodNs) == ErrorCode::kTimeReversed);
  CHECK(fed.at(0.0, 2 * kPeriodNs) == ErrorCode::kTimeJump);
  // A jump of the pose stays one: what was seen before it must be forgotten.
  CHECK(fed.at(0.0, 3 * kPeriodNs) == ErrorCode::kPoseJump);
  CHECK(fed.at(0.0, 4 * kPeriodNs) == ErrorCode::kOk);
}

TEST_CASE("one wrong pose costs one scan") {
  Fed fed;
  for (int i = 0; i < 4; ++i) REQUIRE(fed.next(0.1 * i) == ErrorCode::kOk);
  const ScanResult glitch = fed.next_result(15.0);
  CHECK(glitch.error.code == ErrorCode::kPoseJump);
  CHECK_THAT(glitch.error.message, Contains("pose moved"));
  // What was collected before it is not lost.
  REQUIRE(glitch.keyframe_ready);
  CHECK(fed.pipeline->keyframe().scans.size() == 4);
  PointLabel label = PointLabel::kUnknown;
  CHECK(fed.pipeline->labels(3, {&label, 1}) == 1);
  CHECK(label == PointLabel::kStatic);
  CHECK(fed.next(0.5) == ErrorCode::kOk);
  REQUIRE(fed.pipeline->flush().keyframe_ready);
  CHECK(fed.pipeline->keyframe().scans.size() == 1);
  CHECK(fed.pipeline->keyframe().scans[0].scan_index == 5);
}

TEST_CASE("a glitch is forgotten once the pose has been confirmed") {
  Fed fed;
  for (int i = 0; i < 4; ++i) REQUIRE(fed.next(0.1 * i) == ErrorCode::kOk);
  CHECK(fed.next(30.0) == ErrorCode::kPoseJump);
  for (int i = 4; i < 8; ++i) CHECK(fed.next(0.1 * i) == ErrorCode::kOk);
  // The second glitch agrees with the first, but there were good poses between them.
  CHECK(fed.next(30.0) == ErrorCode::kPoseJump);
  CHECK(fed.next(0.8) == ErrorCode::kOk);
}

TEST_CASE("a restarted odometry is followed, and knows nothing of what was seen before") {
  // In the old coordinates everything up to the far wall was seen through; in the new ones a wall
  // stands there.
  Scene before;
  before.boxes = {standing_box({25.0, 0.0, 2.0}, {0.3, 30.0, 2.0})};
  Scene after;
  after.boxes = {standing_box({12.0, 0.0, 2.0}, {0.3, 8.0, 2.0})};
  OwnedPipeline pipeline(small_config());
  std::int64_t stamp_ns = 0;
  const auto add = [&](const Scene& scene, const Pose& pose) {
    const LabelledScan scan = scene.scan(pose, 0.0);
    return pipeline->add_scan(scan.view(), pose, stamp_ns += kPeriodNs).error.code;
  };
  const Pose restarted = sensor_at(24.0, 0.0, 3.14159);
  for (int i = 0; i < 60; ++i) REQUIRE(add(before, sensor_at(0.0, 0.0)) == ErrorCode::kOk);
  CHECK(add(after, restarted) == ErrorCode::kPoseJump);
  for (int i = 0; i < 10; ++i) REQUIRE(add(after, restarted) == ErrorCode::kOk);
  REQUIRE(pipeline->keyframe().scans.size() == 10);
  CHECK(pipeline->keyframe().statistics->points_dynamic == 0);
}

TEST_CASE("poses that never agree are refused one by one and do no harm") {
  Fed fed;
  REQUIRE(fed.next(0.0) == ErrorCode::kOk);
  for (int i = 1; i < 6; ++i) CHECK(fed.next(100.0 * i) == ErrorCode::kPoseJump);
  CHECK(fed.next(0.0) == ErrorCode::kOk);
}

TEST_CASE("a fast vehicle after a gap has not jumped") {
  Fed fed;
  REQUIRE(fed.at(0.0, 1) == ErrorCode::kOk);
  CHECK(fed.at(25.0, 1 + 10 * kPeriodNs) == ErrorCode::kOk);
}

TEST_CASE("full cells and voxels are counted and everything keeps running") {
  Scene scene;
  scene.boxes = {standing_box({8.0, 0.0, 1.5}, {0.3, 6.0, 1.5}),
                 moving_box({5.0, -3.0, 0.9}, {0.0, 1.4, 0.0}, {0.25, 0.25, 0.9})};
  PipelineConfig config = small_config();
  config.voxel.max_cells = 500;
  config.voxel.max_voxels = 16;
  const auto runs = run_scene(scene, config, 30, [](double t) { return sensor_at(0.5 * t, 0.0); });
  for (const KeyframeRun& run : runs) {
    CHECK(run.statistics.cells == 500);
    CHECK(run.statistics.dropped_by(DropCause::kCellsFull) > 0);
    CHECK(run.statistics.dropped_by(DropCause::kVoxelsFull) > 0);
    CHECK(run.static_cells.size() + run.dynamic_cells.size() == 500);
  }
}

TEST_CASE("points whose block finds no room are counted and stay static, thinned or not") {
  const std::vector<Eigen::Vector3f> points = scattered_points();
  PipelineConfig config = single_scans();
  config.voxel.max_cells = 400;  // a block for every fourth of them
  config.keyframe.downsample_leaf_m = GENERATE(0.0F, 0.2F);
  OwnedPipeline pipeline(config);
  REQUIRE(pipeline->add_scan(view_of(points), sensor_at(0, 0), 1).keyframe_ready);
  const KeyframeStatistics& statistics = *pipeline->keyframe().statistics;
  CHECK(statistics.cells == 100);
  CHECK(statistics.dropped_by(DropCause::kCellsFull) == 300);
  CHECK(pipeline->keyframe().static_cells.size() == 100);
  CHECK(statistics.points_static == 400);
  std::vector<PointLabel> labels(400);
  REQUIRE(pipeline->labels(0, labels) == 400);
  CHECK((labels == std::vector<PointLabel>(400, PointLabel::kStatic)));
}

TEST_CASE("blocks that cannot wait for their final labels are counted") {
  // One cell in each of 150 blocks of a wall, as many as a keyframe can hold. Of four times as
  // many every keyframe of the window, and the current one, can let its part wait.
  PipelineConfig config = single_scans();
  config.voxel.max_cells = 600;
  REQUIRE(config.voxel.max_blocks() == 150);
  REQUIRE(config.removal.window == 10);
  std::vector<Eigen::Vector3f> wall;
  for (int i = 0; i < 150; ++i) {
    wall.emplace_back(9.0F, 0.8F * static_cast<float>(i % 25) - 10.0F,
                      0.8F * static_cast<float>(i / 25) - 1.0F);
  }
  for (const bool final_labels : {true, false}) {
    config.removal.final_labels = final_labels;
    OwnedPipeline pipeline(config);
    for (int k = 0; k < 8; ++k) {
      REQUIRE(pipeline->add_scan(view_of(wall), sensor_at(2.0 * k, 0.0), 1 + k * 5 * kPeriodNs)
                  .keyframe_ready);
      const std::uint64_t full =
          pipeline->keyframe().statistics->dropped_by(DropCause::kEvidenceFull);
      CHECK(full == (final_labels ? 150 - 4 * 150 / 11 : 0));
    }
  }
}

TEST_CASE("the points of a cell are counted up to what its field can hold") {
  PipelineConfig config = single_scans();
  config.keyframe.max_points_per_scan = 80000;
  for (const std::size_t count : {std::size_t{65535}, std::size_t{70000}}) {
    const std::vector<Eigen::Vector3f> points(count, {10.1F, 0.1F, 0.1F});
    OwnedPipeline pipeline(config);
    REQUIRE(pipeline->add_scan(view_of(points), sensor_at(0, 0), 1).keyframe_ready);
    const KeyframeView& keyframe = pipeline->keyframe();
    REQUIRE(keyframe.static_cells.size() + keyframe.dynamic_cells.size() == 1);
    CHECK((keyframe.static_cells.empty() ? keyframe.dynamic_cells : keyframe.static_cells)[0]
              .points == 65535);
    CHECK(keyframe.statistics->points_valid == count);
  }
}

TEST_CASE("the smallest possible capacities hold") {
  PipelineConfig config = single_scans();
  config.keyframe.max_points_per_scan = 16;
  config.voxel.max_cells = 64;
  config.voxel.max_window_blocks = 16;
  config.voxel.max_voxels = 16;
  config.removal.window = 1;
  Fed fed(config);
  for (int i = 1; i < 5; ++i) {
    const ScanResult result = fed.result_at(0, i);
    CHECK(result.error.code == ErrorCode::kOk);
    CHECK(result.keyframe_ready);
  }
}

TEST_CASE("keyframes also close by distance") {
  PipelineConfig config = small_config();
  config.keyframe.scans = 32;
  config.keyframe.distance_m = 2.0F;
  Fed fed(config);
  std::vector<std::size_t> sizes;
  for (int i = 0; i < 40; ++i) {
    // Slow first, then five times as fast.
    const ScanResult result = fed.next_result(i < 20 ? 0.2 * i : 4.0 + (i - 20));
    REQUIRE(result.error.code == ErrorCode::kOk);
    if (result.keyframe_ready) sizes.push_back(fed.pipeline->keyframe().scans.size());
  }
  REQUIRE(sizes.size() > 5);
  CHECK(sizes.front() == 11);
  CHECK(sizes.back() == 3);
}

TEST_CASE("labels are never written beyond the caller's buffer") {
  Fed fed(single_scans());
  REQUIRE(fed.next_result(0).keyframe_ready);
  std::vector<PointLabel> few(5, PointLabel::kDynamic);
  CHECK(fed.pipeline->labels(0, std::span<PointLabel>(few).first(3)) == 3);
  CHECK(few[3] == PointLabel::kDynamic);
  CHECK(fed.pipeline->labels(1, few) == 0);
  CHECK(fed.pipeline->labels(999, few) == 0);
  CHECK(fed.pipeline->labels(0, {}) == 0);
}

TEST_CASE("points may lie anywhere in the caller's records") {
  struct [[gnu::packed]] Record {
    std::uint16_t ring;
    float z;
    float y;
    std::uint8_t tag;
    float x;
  };
  Fed dense(single_scans());
  std::vector<Record> records;
  for (const Eigen::Vector3f& p : dense.scan.points) records.push_back({1, p.z(), p.y(), 2, p.x()});
  OwnedPipeline strided(single_scans());
  REQUIRE(strided
              ->add_scan({reinterpret_cast<const std::byte*>(records.data()), records.size(),
                          sizeof(Record), 11, 6, 2},
                         sensor_at(0, 0), 1)
              .keyframe_ready);
  REQUIRE(dense.next_result(0).keyframe_ready);
  const auto a = strided->keyframe().static_cells;
  const auto b = dense.pipeline->keyframe().static_cells;
  REQUIRE(a.size() == b.size());
  CHECK(std::memcmp(a.data(), b.data(), a.size_bytes()) == 0);
}
