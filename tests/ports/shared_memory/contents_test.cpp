// Tests of keyframes, labels and health in shared memory.
#include "ports/shared_memory/content_reader.hpp"
#include "ports/shared_memory/content_writer.hpp"
#include "ports/shared_memory/pipeline_share.hpp"
#include "ports/shared_memory/unimapper_share.h"
#include "tests/onboard/scene.hpp"
#include "tests/ports/c/c_pipeline.hpp"
#include "tests/ports/shared_memory/content_walk.hpp"
#include "tests/ports/shared_memory/share.hpp"
#include "tests/random.hpp"
#include "tests/test.hpp"
#include "unimapper/onboard/owned_pipeline.hpp"

using namespace unimapper;
using namespace unimapper::shared_memory;
using test::CPipeline;
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
  void step_to_keyframe() {
    while (!step().keyframe_finished) {
    }
  }
};

template <typename Shared, typename Own, typename Same>
bool equal(const Elements<Shared>& shared, std::span<const Own> own, const Same& same) {
  std::size_t i = 0;
  for (; i < shared.size() && i < own.size() && same(shared[i], own[i]); ++i) {
  }
  return i == shared.size() && i == own.size();
}

bool same_vector(const float (&shared)[3], const Eigen::Vector3f& own) {
  return Eigen::Vector3f(shared) == own;
}

bool same_cell(const SharedCell& shared, const FineCell& own) {
  return same_vector(shared.position, own.position) && shared.points == own.points &&
         shared.ground == own.ground;
}

void check_same(const KeyframeMessage& message, const KeyframeView& keyframe) {
  const ContentHead& head = message.fixed.head;
  CHECK(SessionId{head.robot, {head.boot_high, head.boot_low}} == kSession);
  CHECK(head.number == keyframe.sequence);
  CHECK(message.fixed.reference_scan == keyframe.reference_scan);
  CHECK(message.T_odometry_keyframe.rotation == keyframe.T_odometry_keyframe.rotation);
  CHECK(message.T_odometry_keyframe.translation == keyframe.T_odometry_keyframe.translation);
  const float(&up)[3] = message.fixed.up_covariance;
  CHECK(KeyframeUp{message.fixed.up_known != 0, up[0], up[1], up[2]} == keyframe.up);
  CHECK(equal(message.static_cells, keyframe.static_cells, same_cell));
  CHECK(equal(message.dynamic_cells, keyframe.dynamic_cells, same_cell));
  CHECK(equal(message.scans, keyframe.scans, [](const SharedScan& scan, const KeyframeScan& own) {
    return scan.scan_index == own.scan_index && scan.stamp_ns == own.stamp_ns &&
           pose_of(scan.T_odometry_sensor).translation == own.T_odometry_sensor.translation;
  }));
  CHECK(equal(message.keypoints, keyframe.place.keypoints,
              [](const SharedKeypoint& keypoint, const Keypoint& own) {
                return same_vector(keypoint.position, own.position) &&
                       same_vector(keypoint.normal, own.normal) &&
                       keypoint.occupancy == own.occupancy && keypoint.strength == own.strength;
              }));
  CHECK(equal(
      message.planes, keyframe.place.planes, [](const SharedPlane& plane, const PlanePatch& own) {
        return same_vector(plane.center, own.center) && same_vector(plane.normal, own.normal);
      }));
  CHECK(equal(message.loops, keyframe.loops, [](const SharedLoop& loop, const LoopCandidate& own) {
    return loop.match_keyframe == own.match.keyframe && loop.confidence == own.confidence;
  }));
  CHECK(message.fixed.statistics.points_in == keyframe.statistics->points_in);
  CHECK(message.fixed.statistics.points_dynamic == keyframe.statistics->points_dynamic);
}

/// A consumer of one kind of content.
struct Consumer : Reader {
  Consumer(const TestShare& share, const char* topic, ContentKind kind) {
    REQUIRE(open(share.name(), topic, {Start::kLatest, content_of(kind)}).ok);
  }
  using Start = ReaderOptions::Start;

  Sample next() {
    Sample sample;
    REQUIRE(take(sample) == Taken::kMessage);
    return sample;
  }
};

/// A keyframe with an element in every section, as its message.
std::vector<std::byte> full_message() {
  static Drive drive;
  drive.step_to_keyframe();
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
  Consumer keyframes(share, kKeyframeTopic, ContentKind::kKeyframe);
  Consumer labels(share, kLabelsTopic, ContentKind::kLabels);
  Consumer healths(share, kHealthTopic, ContentKind::kHealth);
  std::size_t seen = 0;
  std::size_t dynamic = 0;
  for (int i = 0; i < 40; ++i) {
    const ScanResult result = drive.step();
    REQUIRE(result.error.ok());
    shares.after_scan(*drive.pipeline, result);
    if (!result.keyframe_finished) continue;
    ++seen;
    const Sample sample = keyframes.next();
    const auto message = read_keyframe(sample.bytes());
    REQUIRE(message);
    check_same(*message, drive.pipeline->finished_keyframe());
    CHECK(sample.stamp_ns() == drive.pipeline->finished_keyframe().scans.back().stamp_ns);
    dynamic += message->dynamic_cells.size();
    std::vector<PointLabel> expected(drive.config.keyframe.max_points_per_scan);
    for (std::size_t scan = 0; scan < message->scans.size(); ++scan) {
      const Sample labelled = labels.next();
      const auto of_scan = read_labels(labelled.bytes());
      REQUIRE(of_scan);
      CHECK(of_scan->fixed.head.number == message->scans[scan].scan_index);
      CHECK(of_scan->fixed.keyframe == message->fixed.head.number);
      const std::size_t count = drive.pipeline->labels(scan, expected);
      CHECK(equal(of_scan->labels, std::span<const PointLabel>(expected).first(count),
                  [](std::uint8_t label, PointLabel own) {
                    return label == static_cast<std::uint8_t>(own);
                  }));
    }
    Sample none;
    CHECK(labels.take(none) == Taken::kNothing);
    const auto health = read_health(healths.next().bytes());
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
  REQUIRE(um_config_init(&config, UM_SENSOR_VLP_16) == UM_OK);
  config.voxel_max_cells = drive.config.voxel.max_cells;
  config.keyframe_max_points_per_scan = drive.config.keyframe.max_points_per_scan;
  const CPipeline pipeline(config);
  const auto room =
      um_share_keyframe_room(config.voxel_max_cells, drive.config.descriptor.max_planes);
  CHECK(room >= max_keyframe_bytes(drive.config));
  um_share_writer writer = {};
  um_share_options options = {static_cast<std::uint32_t>(room), 2, 1, 1, UM_SHARE_KEYFRAME, 0};
  const auto open_writer = [&] {
    REQUIRE(um_share_writer_open(&writer, share_of_c.name().c_str(), kKeyframeTopic, &options,
                                 nullptr) == 0);
  };
  open_writer();
  Consumer reader(share, kKeyframeTopic, ContentKind::kKeyframe);
  Consumer reader_of_c(share_of_c, kKeyframeTopic, ContentKind::kKeyframe);

  std::uint32_t seen = 0;
  um_keyframe keyframe = {};
  for (int i = 0; i < 40; ++i) {
    Pose pose;
    const auto scan = drive.scan(pose);
    const um_points points = test::points_of(scan);
    const um_pose c_pose = test::pose_of(pose);
    const std::int64_t stamp_ns = ++drive.scans * 100'000'000;
    REQUIRE(um_add_scan(pipeline, &points, &c_pose, stamp_ns, nullptr) == UM_OK);
    shares.after_scan(*drive.pipeline, drive.pipeline->add_scan(scan.view(), pose, stamp_ns));
    if (um_finished_get(pipeline, &keyframe) != UM_OK) continue;
    ++seen;
    CHECK(um_share_publish_keyframe(&writer, &keyframe, kSession.robot, kSession.boot.high,
                                    kSession.boot.low) == seen);
    const Sample sample = reader.next();
    const Sample sample_of_c = reader_of_c.next();
    CHECK(sample.stamp_ns() == sample_of_c.stamp_ns());
    CHECK(std::equal(sample.bytes().begin(), sample.bytes().end(), sample_of_c.bytes().begin(),
                     sample_of_c.bytes().end()));
  }
  CHECK(seen == 4);

  // What it cannot be is refused, and the topic goes on.
  CHECK(um_share_publish_keyframe(nullptr, &keyframe, 7, 0, 0) == 0);
  um_share_writer_close(&writer);
  CHECK(um_share_publish_keyframe(&writer, &keyframe, 7, 0, 0) == 0);
  options.message_bytes = 1000;  // no room for its cells
  open_writer();
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
  Consumer reader(share, kKeyframeTopic, ContentKind::kKeyframe);
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
  drive.step_to_keyframe();
  const KeyframeView& keyframe = drive.pipeline->finished_keyframe();
  std::vector<std::byte> message(static_cast<std::size_t>(max_keyframe_bytes(drive.config)));
  const std::size_t bytes = write_keyframe(keyframe, kSession, message);
  REQUIRE(bytes > 0);
  message.resize(bytes);
  CHECK(write_keyframe(keyframe, kSession, message) == bytes);
  CHECK(read_keyframe(message));
  message.pop_back();
  CHECK(write_keyframe(keyframe, kSession, message) == 0);
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
  static constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  using Bytes = std::vector<std::byte>;
  using Change = void (*)(SharedKeyframe&, Bytes&);
  const Change changes[] = {
      [](SharedKeyframe& k, Bytes&) { k.T_odometry_keyframe[9] = kNan; },
      [](SharedKeyframe& k, Bytes&) { k.T_odometry_keyframe[0] = 2.0; },
      [](SharedKeyframe& k, Bytes&) { k.reference_scan = k.scans.count; },
      [](SharedKeyframe& k, Bytes& b) { std::memcpy(&b[k.scans.offset + 16], &kNan, 8); },
      [](SharedKeyframe& k, Bytes& b) { std::memcpy(&b[k.loops.offset + 32], &kNan, 8); },
      [](SharedKeyframe& k, Bytes&) { k.head.kind = 2; },
      [](SharedKeyframe& k, Bytes&) { ++k.head.version; },
      [](SharedKeyframe& k, Bytes&) { k.static_cells.offset = 8; },
      [](SharedKeyframe& k, Bytes&) { k.static_cells.stride = 15; },
      [](SharedKeyframe& k, Bytes&) { k.static_cells.count = ~0U; },
      [](SharedKeyframe& k, Bytes&) { k.static_cells.offset += 4; }};
  const Bytes whole = full_message();
  REQUIRE(read_keyframe(whole));
  for (std::size_t i = 0; i < std::size(changes); ++i) {
    CAPTURE(i);
    Bytes message = whole;
    SharedKeyframe fixed;
    std::memcpy(&fixed, message.data(), sizeof fixed);
    changes[i](fixed, message);
    std::memcpy(message.data(), &fixed, sizeof fixed);
    CHECK_FALSE(read_keyframe(message));
  }
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
