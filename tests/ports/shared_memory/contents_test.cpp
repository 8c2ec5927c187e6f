// Tests of keyframes, labels and health in shared memory.
#include <catch2/catch.hpp>
#include <limits>
#include <vector>

#include "ports/c/unimapper.h"
#include "ports/shared_memory/content_reader.hpp"
#include "ports/shared_memory/content_writer.hpp"
#include "ports/shared_memory/pipeline_share.hpp"
#include "ports/shared_memory/unimapper_share.h"
#include "tests/onboard/scene.hpp"
#include "tests/ports/shared_memory/content_walk.hpp"
#include "tests/ports/shared_memory/share.hpp"
#include "tests/random.hpp"
#include "unimapper/onboard/owned_pipeline.hpp"

using namespace unimapper;
using namespace unimapper::shared_memory;
using test::Random;
using test::TestShare;
using test::walk;

namespace {

constexpr SessionId kSession{7, {0xFEDCBA9876543210ULL, 0x0123456789ABCDEFULL}};

PipelineConfig small_config() {
  PipelineConfig config = preset(SensorKind::kVlp16);
  config.voxel.max_cells = 1U << 15U;
  config.keyframe.max_points_per_scan = 1U << 15U;
  return config;
}

/// A pipeline that drives past boxes.
struct Drive {
  PipelineConfig config = small_config();
  OwnedPipeline pipeline{config};
  test::Scene scene;
  std::int64_t scans = 0;

  Drive() {
    REQUIRE(pipeline.ok());
    scene.columns = 360;
    scene.boxes = {test::standing_box({10, 5, 1}, {2, 2, 2}),
                   test::standing_box({-8, -6, 1}, {1, 3, 2}),
                   test::moving_box({12, -4, 1}, {-3, 0, 0}, {0.5, 0.5, 1})};
  }
  /// The next scan, and where it is made.
  test::LabelledScan scan(Pose& pose) const {
    pose.translation = {0.1 * static_cast<double>(scans), 0, 1.5};
    return scene.scan(pose, 0.1 * static_cast<double>(scans));
  }
  ScanResult step() {
    Pose pose;
    const auto scan = this->scan(pose);
    return pipeline->add_scan(scan.view(), pose, ++scans * 100'000'000);
  }
};

bool same(const Elements<SharedCell>& shared, std::span<const FineCell> cells) {
  if (shared.size() != cells.size()) return false;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const SharedCell cell = shared[i];
    if (Eigen::Vector3f(cell.position[0], cell.position[1], cell.position[2]) !=
            cells[i].position ||
        cell.points != cells[i].points || cell.ground != cells[i].ground) {
      return false;
    }
  }
  return true;
}

void check_same(const KeyframeMessage& message, const KeyframeView& keyframe) {
  CHECK(message.fixed.head.boot_high == kSession.boot.high);
  CHECK(message.fixed.head.boot_low == kSession.boot.low);
  CHECK(message.fixed.head.robot == kSession.robot);
  CHECK(message.fixed.head.number == keyframe.sequence);
  CHECK(message.fixed.reference_scan == keyframe.reference_scan);
  CHECK(message.T_odometry_keyframe.rotation == keyframe.T_odometry_keyframe.rotation);
  CHECK(message.T_odometry_keyframe.translation == keyframe.T_odometry_keyframe.translation);
  CHECK((message.fixed.up_known != 0) == keyframe.up.known);
  CHECK(message.fixed.up_covariance[0] == keyframe.up.variance_x);
  CHECK(message.fixed.up_covariance[1] == keyframe.up.covariance_xy);
  CHECK(message.fixed.up_covariance[2] == keyframe.up.variance_y);
  CHECK(same(message.static_cells, keyframe.static_cells));
  CHECK(same(message.dynamic_cells, keyframe.dynamic_cells));
  REQUIRE(message.scans.size() == keyframe.scans.size());
  for (std::size_t i = 0; i < keyframe.scans.size(); ++i) {
    const SharedScan scan = message.scans[i];
    CHECK(scan.scan_index == keyframe.scans[i].scan_index);
    CHECK(scan.stamp_ns == keyframe.scans[i].stamp_ns);
    CHECK(pose_of(scan.T_odometry_sensor).translation ==
          keyframe.scans[i].T_odometry_sensor.translation);
  }
  REQUIRE(message.keypoints.size() == keyframe.place.keypoints.size());
  for (std::size_t i = 0; i < keyframe.place.keypoints.size(); ++i) {
    const SharedKeypoint keypoint = message.keypoints[i];
    CHECK(Eigen::Vector3f(keypoint.position) == keyframe.place.keypoints[i].position);
    CHECK(Eigen::Vector3f(keypoint.normal) == keyframe.place.keypoints[i].normal);
    CHECK(keypoint.occupancy == keyframe.place.keypoints[i].occupancy);
    CHECK(keypoint.strength == keyframe.place.keypoints[i].strength);
  }
  REQUIRE(message.planes.size() == keyframe.place.planes.size());
  for (std::size_t i = 0; i < keyframe.place.planes.size(); ++i) {
    CHECK(Eigen::Vector3f(message.planes[i].center) == keyframe.place.planes[i].center);
    CHECK(Eigen::Vector3f(message.planes[i].normal) == keyframe.place.planes[i].normal);
  }
  REQUIRE(message.loops.size() == keyframe.loops.size());
  for (std::size_t i = 0; i < keyframe.loops.size(); ++i) {
    CHECK(message.loops[i].match_keyframe == keyframe.loops[i].match.keyframe);
    CHECK(message.loops[i].confidence == keyframe.loops[i].confidence);
  }
  CHECK(message.fixed.statistics.points_in == keyframe.statistics->points_in);
  CHECK(message.fixed.statistics.points_dynamic == keyframe.statistics->points_dynamic);
}

/// A keyframe with an element in every section, as its message.
std::vector<std::byte> full_message() {
  static Drive drive;
  while (!drive.step().keyframe_finished) {
  }
  KeyframeView keyframe = drive.pipeline->finished_keyframe();
  static const std::vector<FineCell> dynamic(3, FineCell{{1, 2, 3}, 4, 0, 0});
  static const std::vector<LoopCandidate> loops(2);
  static const std::vector<Keypoint> keypoints(5, Keypoint{{1, 2, 3}, {0, 0, 1}, 9, 2});
  static const std::vector<PlanePatch> planes(4, PlanePatch{{1, 2, 3}, {0, 0, 1}});
  keyframe.static_cells = keyframe.static_cells.first(50);
  keyframe.dynamic_cells = dynamic;
  keyframe.place.keypoints = keypoints;
  keyframe.place.planes = planes;
  keyframe.loops = loops;
  std::vector<std::byte> message(static_cast<std::size_t>(max_keyframe_bytes(drive.config)));
  message.resize(write_keyframe(keyframe, kSession, message));
  REQUIRE(message.size() > sizeof(SharedKeyframe));
  return message;
}

}  // namespace

TEST_CASE("A planner reads the keyframes, labels and health that a pipeline shares") {
  const TestShare share;
  Drive drive;
  PipelineShare shares;
  REQUIRE(shares.open(share.name(), drive.config, kSession).ok);
  Reader keyframes;
  Reader labels;
  Reader healths;
  REQUIRE(keyframes
              .open(share.name(), kKeyframeTopic,
                    {ReaderOptions::Start::kLatest, content_of(ContentKind::kKeyframe)})
              .ok);
  REQUIRE(labels
              .open(share.name(), kLabelsTopic,
                    {ReaderOptions::Start::kLatest, content_of(ContentKind::kLabels)})
              .ok);
  REQUIRE(healths
              .open(share.name(), kHealthTopic,
                    {ReaderOptions::Start::kLatest, content_of(ContentKind::kHealth)})
              .ok);
  std::size_t seen = 0;
  std::size_t dynamic = 0;
  for (int i = 0; i < 40; ++i) {
    const ScanResult result = drive.step();
    REQUIRE(result.error.ok());
    shares.after_scan(*drive.pipeline, result);
    if (!result.keyframe_finished) continue;
    ++seen;
    Sample sample;
    REQUIRE(keyframes.take(sample) == Taken::kMessage);
    const auto message = read_keyframe(sample.bytes());
    REQUIRE(message);
    check_same(*message, drive.pipeline->finished_keyframe());
    CHECK(sample.stamp_ns() == drive.pipeline->finished_keyframe().scans.back().stamp_ns);
    dynamic += message->dynamic_cells.size();
    std::vector<PointLabel> expected(drive.config.keyframe.max_points_per_scan);
    for (std::size_t scan = 0; scan < message->scans.size(); ++scan) {
      REQUIRE(labels.take(sample) == Taken::kMessage);
      const auto of_scan = read_labels(sample.bytes());
      REQUIRE(of_scan);
      CHECK(of_scan->fixed.head.number == message->scans[scan].scan_index);
      CHECK(of_scan->fixed.keyframe == message->fixed.head.number);
      const std::size_t count = drive.pipeline->labels(scan, expected);
      REQUIRE(of_scan->labels.size() == count);
      bool all = true;
      for (std::size_t p = 0; p < count; ++p) {
        all = all && of_scan->labels[p] == static_cast<std::uint8_t>(expected[p]);
      }
      CHECK(all);
    }
    CHECK(labels.take(sample) == Taken::kNothing);
    REQUIRE(healths.take(sample) == Taken::kMessage);
    const auto health = read_health(sample.bytes());
    REQUIRE(health);
    CHECK(health->keyframes == seen);
    CHECK(health->scans == static_cast<std::uint64_t>(i) + 1);
    CHECK(health->scans_refused == 0);
    CHECK(health->not_shared == 0);
  }
  CHECK(seen == 4);
  CHECK(dynamic > 0);
  CHECK(labels.missed() == 0);
  shares.remove();
}

TEST_CASE("A pipeline in C shares the keyframes that one in C++ shares, byte by byte") {
  const TestShare share;
  const TestShare share_of_c;
  Drive drive;
  PipelineShare shares;
  REQUIRE(shares.open(share.name(), drive.config, kSession).ok);
  um_config config;
  REQUIRE(um_config_init(&config, sizeof config, UM_SENSOR_VLP_16) == UM_OK);
  config.voxel_max_cells = drive.config.voxel.max_cells;
  config.keyframe_max_points_per_scan = drive.config.keyframe.max_points_per_scan;
  MemoryBlock block(um_required_bytes(&config));
  um_pipeline* pipeline = nullptr;
  REQUIRE(um_init(&config, block.data(), block.size(), &pipeline, nullptr) == UM_OK);
  const auto room =
      um_share_keyframe_room(config.voxel_max_cells, drive.config.descriptor.max_planes);
  CHECK(room >= max_keyframe_bytes(drive.config));
  um_share_writer writer = {};
  um_share_options options = {static_cast<std::uint32_t>(room), 2, 1, 1, UM_SHARE_KEYFRAME, 0};
  REQUIRE(um_share_writer_open(&writer, share_of_c.name().c_str(), kKeyframeTopic, &options,
                               nullptr) == 0);
  const ReaderOptions from{ReaderOptions::Start::kLatest, content_of(ContentKind::kKeyframe)};
  Reader reader;
  Reader reader_of_c;
  REQUIRE(reader.open(share.name(), kKeyframeTopic, from).ok);
  REQUIRE(reader_of_c.open(share_of_c.name(), kKeyframeTopic, from).ok);

  std::uint32_t seen = 0;
  um_keyframe keyframe = {};
  for (int i = 0; i < 40; ++i) {
    Pose pose;
    const auto scan = drive.scan(pose);
    const um_points points = {scan.points.data(), scan.points.size(), 12, 0, 4, 8};
    const um_pose c_pose = {{1, 0, 0, pose.translation.x(), 0, 1, 0, pose.translation.y(), 0, 0, 1,
                             pose.translation.z()}};
    const std::int64_t stamp_ns = ++drive.scans * 100'000'000;
    REQUIRE(um_add_scan(pipeline, &points, &c_pose, stamp_ns, nullptr) == UM_OK);
    shares.after_scan(*drive.pipeline, drive.pipeline->add_scan(scan.view(), pose, stamp_ns));
    keyframe.struct_size = sizeof keyframe;
    if (um_finished_get(pipeline, &keyframe) != UM_OK) continue;
    ++seen;
    CHECK(um_share_publish_keyframe(&writer, &keyframe, kSession.robot, kSession.boot.high,
                                    kSession.boot.low) == seen);
    Sample sample;
    Sample sample_of_c;
    REQUIRE(reader.take(sample) == Taken::kMessage);
    REQUIRE(reader_of_c.take(sample_of_c) == Taken::kMessage);
    CHECK(sample.stamp_ns() == sample_of_c.stamp_ns());
    CHECK(std::equal(sample.bytes().begin(), sample.bytes().end(), sample_of_c.bytes().begin(),
                     sample_of_c.bytes().end()));
  }
  CHECK(seen == 4);

  // What it cannot be is refused, and the topic goes on.
  CHECK(um_share_publish_keyframe(nullptr, &keyframe, 7, 0, 0) == 0);
  CHECK(um_share_publish_keyframe(&writer, nullptr, 7, 0, 0) == 0);
  um_keyframe older = keyframe;
  older.struct_size -= 8;
  CHECK(um_share_publish_keyframe(&writer, &older, 7, 0, 0) == 0);
  um_share_writer_close(&writer);
  CHECK(um_share_publish_keyframe(&writer, &keyframe, 7, 0, 0) == 0);
  options.message_bytes = 1000;  // no room for its cells
  REQUIRE(um_share_writer_open(&writer, share_of_c.name().c_str(), kKeyframeTopic, &options,
                               nullptr) == 0);
  CHECK(um_share_publish_keyframe(&writer, &keyframe, 7, 0, 0) == 0);
  um_share_writer_remove(&writer);
}

TEST_CASE("A keyframe that does not fit its topic is counted and not shared") {
  const TestShare share;
  Drive drive;
  PipelineConfig smaller = drive.config;
  smaller.voxel.max_cells = 64;
  PipelineShare shares;
  REQUIRE(shares.open(share.name(), smaller, kSession).ok);
  for (int i = 0; i < 10; ++i) shares.after_scan(*drive.pipeline, drive.step());
  CHECK(shares.health().keyframes == 1);
  CHECK(shares.health().not_shared == 1);
  Reader reader;
  REQUIRE(reader
              .open(share.name(), kKeyframeTopic,
                    {ReaderOptions::Start::kLatest, content_of(ContentKind::kKeyframe)})
              .ok);
  Sample sample;
  CHECK(reader.take(sample) == Taken::kNothing);
}

TEST_CASE("Whatever is kept of a message but all of it is refused") {
  const std::vector<std::byte> message = full_message();
  REQUIRE(read_keyframe(message));
  for (std::size_t bytes = 0; bytes < message.size(); bytes += bytes < 600 ? 1 : 37) {
    const std::vector<std::byte> part(message.begin(),
                                      message.begin() + static_cast<std::ptrdiff_t>(bytes));
    CHECK_FALSE(read_keyframe(part));
    CHECK_FALSE(read_labels(part));
    CHECK_FALSE(read_health(part));
  }
}

TEST_CASE("A message may be written to memory of exactly its size, and to none smaller") {
  Drive drive;
  while (!drive.step().keyframe_finished) {
  }
  const KeyframeView& keyframe = drive.pipeline->finished_keyframe();
  std::vector<std::byte> message(static_cast<std::size_t>(max_keyframe_bytes(drive.config)));
  const std::size_t bytes = write_keyframe(keyframe, kSession, message);
  REQUIRE(bytes > 0);
  std::vector<std::byte> exact(bytes);
  CHECK(write_keyframe(keyframe, kSession, exact) == bytes);
  CHECK(read_keyframe(exact));
  std::vector<std::byte> smaller(bytes - 1);
  CHECK(write_keyframe(keyframe, kSession, smaller) == 0);
  CHECK(write_keyframe(keyframe, kSession, {}) == 0);
}

TEST_CASE("A message with a number changed is refused or read within its bounds") {
  const std::vector<std::byte> message = full_message();
  Random random(3);
  std::size_t accepted = 0;
  for (int i = 0; i < 20000; ++i) {
    // Exactly its bytes on the heap, so that a sanitizer sees the first one too far.
    std::vector<std::byte> bad = message;
    for (std::uint32_t changes = 1 + random.below(3); changes > 0; --changes) {
      const std::size_t words = (random.below(2) == 0 ? 160 : bad.size()) / 4;
      const std::uint32_t at = random.below(static_cast<std::uint32_t>(words));
      std::uint32_t word = 0;
      std::memcpy(&word, bad.data() + 4 * std::size_t{at}, 4);
      const std::uint32_t kind = random.below(4);
      if (kind == 0) word = static_cast<std::uint32_t>(random.bits());
      if (kind == 1) word += random.below(17) - 8;
      if (kind == 2) word = ~0U - random.below(16);
      if (kind == 3) word ^= 1U << random.below(32);
      std::memcpy(bad.data() + 4 * std::size_t{at}, &word, 4);
    }
    const auto keyframe = read_keyframe(bad);
    if (!keyframe) continue;
    ++accepted;
    REQUIRE(walk(*keyframe, bad));
  }
  CHECK(accepted > 1000);
}

TEST_CASE("Poses that are not finite or not rigid and scans that are not there are refused") {
  const auto changed = [](auto change) {
    std::vector<std::byte> message = full_message();
    SharedKeyframe fixed;
    std::memcpy(&fixed, message.data(), sizeof fixed);
    change(fixed, message);
    std::memcpy(message.data(), &fixed, sizeof fixed);
    return read_keyframe(message).has_value();
  };
  using Bytes = std::vector<std::byte>;
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  CHECK(changed([](SharedKeyframe&, Bytes&) {}));
  CHECK_FALSE(changed([&](SharedKeyframe& k, Bytes&) { k.T_odometry_keyframe[9] = kNan; }));
  CHECK_FALSE(changed([](SharedKeyframe& k, Bytes&) { k.T_odometry_keyframe[0] = 2.0; }));
  CHECK_FALSE(changed([](SharedKeyframe& k, Bytes&) { k.reference_scan = k.scans.count; }));
  CHECK_FALSE(changed([&](SharedKeyframe& k, Bytes& bytes) {
    std::memcpy(bytes.data() + k.scans.offset + 16, &kNan, sizeof kNan);
  }));
  CHECK_FALSE(changed([&](SharedKeyframe& k, Bytes& bytes) {
    std::memcpy(bytes.data() + k.loops.offset + 32, &kNan, sizeof kNan);
  }));
  CHECK_FALSE(changed([](SharedKeyframe& k, Bytes&) { k.head.kind = 2; }));
  CHECK_FALSE(changed([](SharedKeyframe& k, Bytes&) { ++k.head.version; }));
  CHECK_FALSE(changed([](SharedKeyframe& k, Bytes&) { k.static_cells.offset = 8; }));
  CHECK_FALSE(changed([](SharedKeyframe& k, Bytes&) { k.static_cells.stride = 15; }));
  CHECK_FALSE(changed([](SharedKeyframe& k, Bytes&) { k.static_cells.count = ~0U; }));
  CHECK_FALSE(changed([](SharedKeyframe& k, Bytes&) { k.static_cells.offset += 4; }));
}

TEST_CASE("C programs read the same keyframe") {
  const std::vector<std::byte> bytes = full_message();
  const auto expected = read_keyframe(bytes);
  REQUIRE(expected);
  um_share_message message = {};
  message.bytes = bytes.data();
  message.size = bytes.size();
  um_share_keyframe keyframe = {};
  REQUIRE(um_share_read_keyframe(&message, &keyframe) == 1);
  CHECK(keyframe.robot == kSession.robot);
  CHECK(keyframe.boot_high == kSession.boot.high);
  CHECK(keyframe.boot_low == kSession.boot.low);
  CHECK(keyframe.sequence == expected->fixed.head.number);
  CHECK(keyframe.translation[0] == expected->T_odometry_keyframe.translation.x());
  CHECK(keyframe.rotation[1] == expected->T_odometry_keyframe.rotation(0, 1));
  CHECK(keyframe.dynamic_cells.count == expected->dynamic_cells.size());
  REQUIRE(keyframe.static_cells.count == expected->static_cells.size());
  for (std::size_t i = 0; i < keyframe.static_cells.count; ++i) {
    const um_share_cell cell = um_share_cell_at(&keyframe.static_cells, i);
    const SharedCell same = expected->static_cells[i];
    CHECK(std::memcmp(&cell, &same, sizeof cell) == 0);
  }
  message.size -= 1;
  CHECK(um_share_read_keyframe(&message, &keyframe) == 0);
}
