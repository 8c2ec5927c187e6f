// Bad input: refused or skipped, and counted
#include <catch2/catch.hpp>
#include <limits>
#include <string>

#include "run.hpp"

using namespace unimapper;
using namespace unimapper::test;

namespace {

constexpr std::int64_t kPeriodNs = 100000000;
const float kNan = std::numeric_limits<float>::quiet_NaN();
const float kInfinity = std::numeric_limits<float>::infinity();

LabelledScan plain_scan() {
  Scene scene;
  scene.columns = 180;
  scene.boxes = {standing_box({8.0, 0.0, 1.5}, {0.3, 6.0, 1.5})};
  return scene.scan(sensor_at(0.0, 0.0), 0.0);
}

std::vector<PointLabel> labels_of(Pipeline& pipeline, std::size_t scan, std::size_t points) {
  std::vector<PointLabel> labels(points);
  REQUIRE(pipeline.labels(scan, labels) == points);
  return labels;
}

}  // namespace

TEST_CASE("points that are not finite or out of range are skipped, counted and unknown") {
  LabelledScan scan = plain_scan();
  const std::size_t good = scan.points.size();
  scan.points.insert(scan.points.end(), {{kNan, 1.0F, 1.0F},
                                         {1.0F, kInfinity, 1.0F},
                                         {1.0F, 1.0F, -kInfinity},
                                         {0.0F, 0.0F, 0.0F},
                                         {1e6F, 0.0F, 0.0F},
                                         {1e30F, 1e30F, 1e30F}});
  OwnedPipeline pipeline(small_config());
  REQUIRE(pipeline->add_scan(scan.view(), sensor_at(0, 0), 1).error.code == ErrorCode::kOk);
  REQUIRE(pipeline->flush().keyframe_ready);
  const KeyframeStatistics& statistics = *pipeline->keyframe().statistics;
  CHECK(statistics.points_in == good + 6);
  CHECK(statistics.points_valid == good);
  CHECK(statistics.dropped_by(DropCause::kNotFinite) == 3);
  CHECK(statistics.dropped_by(DropCause::kOutOfRange) == 3);
  const auto labels = labels_of(*pipeline, 0, scan.points.size());
  for (std::size_t i = 0; i < labels.size(); ++i) {
    CHECK((labels[i] == PointLabel::kUnknown) == (i >= good));
  }
}

TEST_CASE("a scan without a single valid point is refused and leaves no trace") {
  OwnedPipeline pipeline(small_config());
  const LabelledScan good = plain_scan();
  const std::vector<Eigen::Vector3f> bad(10, {kNan, kNan, kNan});
  const PointView none = PointView::xyz(nullptr, 0, 12);
  const PointView invalid = PointView::xyz(bad.data(), bad.size(), 12);

  CHECK(pipeline->add_scan(none, sensor_at(0, 0), 1).error.code == ErrorCode::kEmptyScan);
  CHECK_FALSE(pipeline->flush().keyframe_ready);
  REQUIRE(pipeline->add_scan(good.view(), sensor_at(0, 0), 2).error.code == ErrorCode::kOk);
  const ScanResult refused = pipeline->add_scan(invalid, sensor_at(0, 0), 3);
  CHECK(refused.error.code == ErrorCode::kEmptyScan);
  CHECK(std::string(refused.error.message).find("no point") != std::string::npos);
  // The refused stamp does not count.
  CHECK(pipeline->add_scan(good.view(), sensor_at(0, 0), 3).error.code == ErrorCode::kOk);
  REQUIRE(pipeline->flush().keyframe_ready);
  CHECK(pipeline->keyframe().scans.size() == 2);
  CHECK(pipeline->keyframe().scans[1].scan_index == 3);
}

TEST_CASE("a pose that is no pose is refused with a reason") {
  OwnedPipeline pipeline(small_config());
  const LabelledScan scan = plain_scan();
  Pose nan = sensor_at(0, 0);
  nan.translation.y() = std::numeric_limits<double>::quiet_NaN();
  Pose scaled = sensor_at(0, 0);
  scaled.rotation *= 2.0;
  Pose absurd = sensor_at(1e15, 0);
  for (const Pose& pose : {nan, scaled, absurd}) {
    const ScanResult result = pipeline->add_scan(scan.view(), pose, 1);
    CHECK(result.error.code == ErrorCode::kInvalidPose);
    CHECK(std::string(result.error.message).find("pose") != std::string::npos);
  }
  CHECK(pipeline->add_scan(scan.view(), sensor_at(0, 0), 1).error.code == ErrorCode::kOk);
}

TEST_CASE("time that stands still or goes backwards is refused") {
  OwnedPipeline pipeline(small_config());
  const LabelledScan scan = plain_scan();
  REQUIRE(pipeline->add_scan(scan.view(), sensor_at(0, 0), 1000).error.code == ErrorCode::kOk);
  CHECK(pipeline->add_scan(scan.view(), sensor_at(0, 0), 1000).error.code ==
        ErrorCode::kTimeReversed);
  CHECK(pipeline->add_scan(scan.view(), sensor_at(0, 0), 999).error.code ==
        ErrorCode::kTimeReversed);
  CHECK(pipeline->add_scan(scan.view(), sensor_at(0, 0), 1001).error.code == ErrorCode::kOk);
}

TEST_CASE("a clock that is set back costs two scans") {
  OwnedPipeline pipeline(small_config());
  const LabelledScan scan = plain_scan();
  constexpr std::int64_t kHourNs = 3600000000000;
  const auto add = [&](int i, std::int64_t offset_ns) {
    return pipeline->add_scan(scan.view(), sensor_at(0.1 * i, 0),
                              2 * kHourNs + i * kPeriodNs + offset_ns);
  };
  for (int i = 0; i < 4; ++i) REQUIRE(add(i, 0).error.code == ErrorCode::kOk);
  const ScanResult first = add(4, -kHourNs);
  CHECK(first.error.code == ErrorCode::kTimeReversed);
  CHECK_FALSE(first.keyframe_ready);
  const ScanResult second = add(5, -kHourNs);
  CHECK(second.error.code == ErrorCode::kTimeJump);
  CHECK(std::string(second.error.message).find("clock") != std::string::npos);
  // Scans of both times do not share a keyframe.
  REQUIRE(second.keyframe_ready);
  CHECK(pipeline->keyframe().scans.size() == 4);
  for (int i = 6; i < 12; ++i) CHECK(add(i, -kHourNs).error.code == ErrorCode::kOk);
  REQUIRE(pipeline->flush().keyframe_ready);
  CHECK(pipeline->keyframe().scans.size() == 6);
}

TEST_CASE("stamps from the past that do not increase never set the clock back") {
  OwnedPipeline pipeline(small_config());
  const LabelledScan scan = plain_scan();
  const auto add = [&](std::int64_t stamp_ns) {
    return pipeline->add_scan(scan.view(), sensor_at(0, 0), stamp_ns).error.code;
  };
  REQUIRE(add(100 * kPeriodNs) == ErrorCode::kOk);
  for (int i = 0; i < 5; ++i) CHECK(add(50 * kPeriodNs) == ErrorCode::kTimeReversed);
  for (int i = 0; i < 5; ++i) CHECK(add((49 - i) * kPeriodNs) == ErrorCode::kTimeReversed);
  CHECK(add(101 * kPeriodNs) == ErrorCode::kOk);
  // Late scans one at a time are no clock that was set.
  for (int i = 0; i < 5; ++i) {
    CHECK(add((60 + i) * kPeriodNs) == ErrorCode::kTimeReversed);
    CHECK(add((102 + i) * kPeriodNs) == ErrorCode::kOk);
  }
}

TEST_CASE("one stamp from far in the future costs one scan") {
  OwnedPipeline pipeline(small_config());
  const LabelledScan scan = plain_scan();
  constexpr std::int64_t kHourNs = 3600000000000;
  const auto add = [&](int i, std::int64_t offset_ns) {
    return pipeline->add_scan(scan.view(), sensor_at(0.1 * i, 0), i * kPeriodNs + offset_ns);
  };
  for (int i = 0; i < 4; ++i) REQUIRE(add(i, 0).error.code == ErrorCode::kOk);
  CHECK(add(4, kHourNs).error.code == ErrorCode::kTimeJump);
  CHECK(add(5, 0).error.code == ErrorCode::kOk);
  CHECK(add(6, std::numeric_limits<std::int64_t>::max() - kHourNs).error.code ==
        ErrorCode::kTimeJump);
  CHECK(add(7, 0).error.code == ErrorCode::kOk);
}

TEST_CASE("a clock that is set ahead costs one scan") {
  OwnedPipeline pipeline(small_config());
  const LabelledScan scan = plain_scan();
  constexpr std::int64_t kHourNs = 3600000000000;
  const auto add = [&](int i, std::int64_t offset_ns) {
    return pipeline->add_scan(scan.view(), sensor_at(0.1 * i, 0), i * kPeriodNs + offset_ns);
  };
  for (int i = 0; i < 4; ++i) REQUIRE(add(i, 0).error.code == ErrorCode::kOk);
  const ScanResult jump = add(4, kHourNs);
  CHECK(jump.error.code == ErrorCode::kTimeJump);
  CHECK(jump.keyframe_ready);
  for (int i = 5; i < 9; ++i) CHECK(add(i, kHourNs).error.code == ErrorCode::kOk);
}

TEST_CASE("a clock that is set back while the odometry jumps is followed as well") {
  OwnedPipeline pipeline(small_config());
  const LabelledScan scan = plain_scan();
  constexpr std::int64_t kHourNs = 3600000000000;
  const auto add = [&](double x, std::int64_t stamp_ns) {
    return pipeline->add_scan(scan.view(), sensor_at(x, 0), stamp_ns).error.code;
  };
  for (int i = 0; i < 4; ++i) REQUIRE(add(500.0, kHourNs + i * kPeriodNs) == ErrorCode::kOk);
  CHECK(add(0.0, 1 * kPeriodNs) == ErrorCode::kTimeReversed);
  CHECK(add(0.0, 2 * kPeriodNs) == ErrorCode::kTimeJump);
  // A jump of the pose stays one: what was seen before it must be forgotten.
  CHECK(add(0.0, 3 * kPeriodNs) == ErrorCode::kPoseJump);
  CHECK(add(0.0, 4 * kPeriodNs) == ErrorCode::kOk);
}

TEST_CASE("one wrong pose costs one scan") {
  OwnedPipeline pipeline(small_config());
  const LabelledScan scan = plain_scan();
  std::int64_t stamp = 0;
  const auto add = [&](double x) {
    return pipeline->add_scan(scan.view(), sensor_at(x, 0), stamp += kPeriodNs);
  };
  for (int i = 0; i < 4; ++i) REQUIRE(add(0.1 * i).error.code == ErrorCode::kOk);
  const ScanResult glitch = add(15.0);
  CHECK(glitch.error.code == ErrorCode::kPoseJump);
  CHECK(std::string(glitch.error.message).find("pose moved") != std::string::npos);
  // What was collected before it is not lost.
  REQUIRE(glitch.keyframe_ready);
  CHECK(pipeline->keyframe().scans.size() == 4);
  CHECK(labels_of(*pipeline, 3, scan.points.size())[0] == PointLabel::kStatic);
  CHECK(add(0.5).error.code == ErrorCode::kOk);
  REQUIRE(pipeline->flush().keyframe_ready);
  CHECK(pipeline->keyframe().scans.size() == 1);
  CHECK(pipeline->keyframe().scans[0].scan_index == 5);
}

TEST_CASE("a restarted odometry is followed after one refused scan") {
  OwnedPipeline pipeline(small_config());
  const LabelledScan scan = plain_scan();
  std::int64_t stamp = 0;
  const auto add = [&](double x) {
    return pipeline->add_scan(scan.view(), sensor_at(x, 0), stamp += kPeriodNs);
  };
  for (int i = 0; i < 12; ++i) REQUIRE(add(100.0 + 0.1 * i).error.code == ErrorCode::kOk);
  CHECK(add(0.0).error.code == ErrorCode::kPoseJump);
  for (int i = 1; i < 12; ++i) CHECK(add(0.1 * i).error.code == ErrorCode::kOk);
}

TEST_CASE("a glitch is forgotten once the pose has been confirmed") {
  OwnedPipeline pipeline(small_config());
  const LabelledScan scan = plain_scan();
  std::int64_t stamp = 0;
  const auto add = [&](double x) {
    return pipeline->add_scan(scan.view(), sensor_at(x, 0), stamp += kPeriodNs).error.code;
  };
  for (int i = 0; i < 4; ++i) REQUIRE(add(0.1 * i) == ErrorCode::kOk);
  CHECK(add(30.0) == ErrorCode::kPoseJump);
  for (int i = 4; i < 8; ++i) CHECK(add(0.1 * i) == ErrorCode::kOk);
  // The second glitch agrees with the first, but there were good poses between them.
  CHECK(add(30.0) == ErrorCode::kPoseJump);
  CHECK(add(0.8) == ErrorCode::kOk);
}

TEST_CASE("a restarted odometry knows nothing of what was seen before") {
  // In the old coordinates everything up to the far wall was seen through; in the new ones a wall
  // stands there.
  Scene before;
  before.boxes = {standing_box({25.0, 0.0, 2.0}, {0.3, 30.0, 2.0})};
  Scene after;
  after.boxes = {standing_box({12.0, 0.0, 2.0}, {0.3, 8.0, 2.0})};
  OwnedPipeline pipeline(small_config());
  std::int64_t stamp = 0;
  const auto add = [&](const Scene& scene, double x) {
    const LabelledScan scan = scene.scan(sensor_at(x, 0.0, x > 20.0 ? 3.14159 : 0.0), 0.0);
    return pipeline->add_scan(scan.view(), sensor_at(x, 0.0, x > 20.0 ? 3.14159 : 0.0),
                              stamp += kPeriodNs);
  };
  for (int i = 0; i < 60; ++i) REQUIRE(add(before, 0.0).error.code == ErrorCode::kOk);
  CHECK(add(after, 24.0).error.code == ErrorCode::kPoseJump);
  for (int i = 0; i < 10; ++i) REQUIRE(add(after, 24.0).error.code == ErrorCode::kOk);
  REQUIRE(pipeline->keyframe().scans.size() == 10);
  CHECK(pipeline->keyframe().statistics->points_dynamic == 0);
}

TEST_CASE("poses that never agree are refused one by one and do no harm") {
  OwnedPipeline pipeline(small_config());
  const LabelledScan scan = plain_scan();
  REQUIRE(pipeline->add_scan(scan.view(), sensor_at(0, 0), 1).error.code == ErrorCode::kOk);
  for (int i = 1; i < 6; ++i) {
    CHECK(pipeline->add_scan(scan.view(), sensor_at(100.0 * i, 0), 1 + i * kPeriodNs).error.code ==
          ErrorCode::kPoseJump);
  }
  CHECK(pipeline->add_scan(scan.view(), sensor_at(0, 0), 10 * kPeriodNs).error.code ==
        ErrorCode::kOk);
}

TEST_CASE("a fast vehicle after a gap has not jumped") {
  OwnedPipeline pipeline(small_config());
  const LabelledScan scan = plain_scan();
  REQUIRE(pipeline->add_scan(scan.view(), sensor_at(0, 0), 1).error.code == ErrorCode::kOk);
  CHECK(pipeline->add_scan(scan.view(), sensor_at(25.0, 0), 1 + 10 * kPeriodNs).error.code ==
        ErrorCode::kOk);
}

TEST_CASE("points beyond a scan's capacity are counted and labelled static") {
  const LabelledScan scan = plain_scan();
  PipelineConfig config = small_config();
  config.keyframe.max_points_per_scan = 100;
  OwnedPipeline pipeline(config);
  REQUIRE(pipeline->add_scan(scan.view(), sensor_at(0, 0), 1).error.code == ErrorCode::kOk);
  REQUIRE(pipeline->flush().keyframe_ready);
  const KeyframeStatistics& statistics = *pipeline->keyframe().statistics;
  CHECK(statistics.dropped_by(DropCause::kScanTooLarge) == scan.points.size() - 100);
  for (const PointLabel label : labels_of(*pipeline, 0, scan.points.size())) {
    CHECK(label == PointLabel::kStatic);
  }
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

TEST_CASE("points whose block finds no room are counted and stay static") {
  // Cells far from each other: a block for each of them, and there is a block for every fourth.
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 400; ++i) {
    points.emplace_back(2.0F * static_cast<float>(i % 20) - 19.0F,
                        2.0F * static_cast<float>(i / 20) - 19.0F, 2.0F);
  }
  PipelineConfig config = small_config();
  config.voxel.max_cells = 400;
  OwnedPipeline pipeline(config);
  const PointView view = PointView::xyz(points.data(), points.size(), sizeof(points[0]));
  REQUIRE(pipeline->add_scan(view, sensor_at(0, 0), 1).error.code == ErrorCode::kOk);
  REQUIRE(pipeline->flush().keyframe_ready);
  const KeyframeStatistics& statistics = *pipeline->keyframe().statistics;
  CHECK(statistics.cells == 100);
  CHECK(statistics.dropped_by(DropCause::kCellsFull) == 300);
  CHECK(pipeline->keyframe().static_cells.size() == 100);
  CHECK(statistics.points_static == 400);
  for (const PointLabel label : labels_of(*pipeline, 0, points.size())) {
    CHECK(label == PointLabel::kStatic);
  }
}

TEST_CASE("points whose block finds no room are counted with down-sampling, too") {
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 400; ++i) {
    points.emplace_back(2.0F * static_cast<float>(i % 20) - 19.0F,
                        2.0F * static_cast<float>(i / 20) - 19.0F, 2.0F);
  }
  PipelineConfig config = small_config();
  config.voxel.max_cells = 400;
  config.keyframe.downsample_leaf_m = 0.2F;
  OwnedPipeline pipeline(config);
  REQUIRE(pipeline);
  const PointView view = PointView::xyz(points.data(), points.size(), sizeof(points[0]));
  REQUIRE(pipeline->add_scan(view, sensor_at(0, 0), 1).error.code == ErrorCode::kOk);
  REQUIRE(pipeline->flush().keyframe_ready);
  const KeyframeStatistics& statistics = *pipeline->keyframe().statistics;
  CHECK(statistics.cells == 100);
  CHECK(statistics.dropped_by(DropCause::kCellsFull) == 300);
}

TEST_CASE("blocks that cannot wait for their final labels are counted") {
  // One cell in each of 150 blocks of a wall, as many as a keyframe can hold. Of four times as
  // many every keyframe of the window, and the current one, can let its part wait.
  PipelineConfig config = small_config();
  config.keyframe.scans = 1;
  config.free_space.images_per_keyframe = 1;
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
    REQUIRE(pipeline);
    for (int k = 0; k < 8; ++k) {
      const PointView view = PointView::xyz(wall.data(), wall.size(), sizeof(wall[0]));
      const ScanResult result =
          pipeline->add_scan(view, sensor_at(2.0 * k, 0.0), 1 + k * 5 * kPeriodNs);
      REQUIRE(result.error.code == ErrorCode::kOk);
      REQUIRE(result.keyframe_ready);
      const std::uint64_t full =
          pipeline->keyframe().statistics->dropped_by(DropCause::kEvidenceFull);
      CHECK(full == (final_labels ? 150 - 4 * 150 / 11 : 0));
    }
  }
}

TEST_CASE("the points of a cell are counted up to what its field can hold") {
  const Eigen::Vector3f point(10.1F, 0.1F, 0.1F);
  for (const std::size_t count : {std::size_t{65535}, std::size_t{70000}}) {
    const std::vector<Eigen::Vector3f> points(count, point);
    PipelineConfig config = small_config();
    config.keyframe.max_points_per_scan = 80000;
    OwnedPipeline pipeline(config);
    REQUIRE(pipeline);
    const PointView view = PointView::xyz(points.data(), points.size(), sizeof(point));
    REQUIRE(pipeline->add_scan(view, sensor_at(0, 0), 1).error.code == ErrorCode::kOk);
    REQUIRE(pipeline->flush().keyframe_ready);
    const KeyframeView& keyframe = pipeline->keyframe();
    REQUIRE(keyframe.static_cells.size() + keyframe.dynamic_cells.size() == 1);
    CHECK((keyframe.static_cells.empty() ? keyframe.dynamic_cells : keyframe.static_cells)[0]
              .points == 65535);
    CHECK(keyframe.statistics->points_valid == count);
  }
}

TEST_CASE("the smallest possible capacities hold") {
  PipelineConfig config = small_config();
  config.keyframe.max_points_per_scan = 16;
  config.keyframe.scans = 1;
  config.free_space.images_per_keyframe = 1;
  config.voxel.max_cells = 64;
  config.voxel.max_window_blocks = 16;
  config.voxel.max_voxels = 16;
  config.removal.window = 1;
  OwnedPipeline pipeline(config);
  REQUIRE(pipeline);
  const LabelledScan scan = plain_scan();
  for (int i = 1; i < 5; ++i) {
    const ScanResult result = pipeline->add_scan(scan.view(), sensor_at(0, 0), i);
    CHECK(result.error.code == ErrorCode::kOk);
    CHECK(result.keyframe_ready);
  }
}

TEST_CASE("keyframes also close by distance") {
  PipelineConfig config = small_config();
  config.keyframe.scans = 32;
  config.keyframe.distance_m = 2.0F;
  OwnedPipeline pipeline(config);
  const LabelledScan scan = plain_scan();
  std::vector<std::size_t> sizes;
  for (int i = 0; i < 40; ++i) {
    // Slow first, then five times as fast.
    const double x = i < 20 ? 0.2 * i : 4.0 + (i - 20);
    const ScanResult result = pipeline->add_scan(scan.view(), sensor_at(x, 0), 1 + i * kPeriodNs);
    REQUIRE(result.error.code == ErrorCode::kOk);
    if (result.keyframe_ready) sizes.push_back(pipeline->keyframe().scans.size());
  }
  REQUIRE(sizes.size() > 5);
  CHECK(sizes.front() == 11);
  CHECK(sizes.back() == 3);
}

TEST_CASE("labels are never written beyond the caller's buffer") {
  OwnedPipeline pipeline(small_config());
  const LabelledScan scan = plain_scan();
  REQUIRE(pipeline->add_scan(scan.view(), sensor_at(0, 0), 1).error.code == ErrorCode::kOk);
  REQUIRE(pipeline->flush().keyframe_ready);
  std::vector<PointLabel> few(5, PointLabel::kDynamic);
  CHECK(pipeline->labels(0, std::span<PointLabel>(few).first(3)) == 3);
  CHECK(few[3] == PointLabel::kDynamic);
  CHECK(pipeline->labels(1, few) == 0);
  CHECK(pipeline->labels(999, few) == 0);
  CHECK(pipeline->labels(0, {}) == 0);
}

TEST_CASE("points may lie anywhere in the caller's records") {
  const LabelledScan scan = plain_scan();
  struct [[gnu::packed]] Record {
    std::uint16_t ring;
    float z;
    float y;
    std::uint8_t tag;
    float x;
  };
  std::vector<Record> records;
  for (const Eigen::Vector3f& p : scan.points) records.push_back({1, p.z(), p.y(), 2, p.x()});
  const PointView view{
      reinterpret_cast<const std::byte*>(records.data()), records.size(), sizeof(Record), 11, 6, 2};
  OwnedPipeline strided(small_config());
  OwnedPipeline dense(small_config());
  REQUIRE(strided->add_scan(view, sensor_at(0, 0), 1).error.code == ErrorCode::kOk);
  REQUIRE(dense->add_scan(scan.view(), sensor_at(0, 0), 1).error.code == ErrorCode::kOk);
  (void)strided->flush();
  (void)dense->flush();
  const auto a = strided->keyframe().static_cells;
  const auto b = dense->keyframe().static_cells;
  REQUIRE(a.size() == b.size());
  CHECK(std::memcmp(a.data(), b.data(), a.size_bytes()) == 0);
}
