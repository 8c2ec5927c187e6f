// Validation of parameters, memory and names
#include "run.hpp"
#include "tests/test.hpp"

using namespace unimapper;
using namespace unimapper::test;
using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;

TEST_CASE("every preset is valid, fits the sensor's scans and the memory of the computer") {
  struct Limit {
    Computer computer;
    std::size_t bytes;
  };
  for (const SensorModel& sensor : sensor_models()) {
    for (const auto& [computer, bytes] :
         {Limit{Computer::kServer, 256'000'000}, Limit{Computer::kJetson, 192'000'000},
          Limit{Computer::kRaspberryPi, 64'000'000}, Limit{Computer::kArmv7With64Mb, 64'000'000}}) {
      const PipelineConfig config = preset(sensor.kind, computer);
      CAPTURE(sensor.name, static_cast<int>(computer));
      CHECK(config.validate().ok());
      CHECK(Pipeline::required_bytes(config) <= bytes);
      CHECK(config.keyframe.max_points_per_scan >= sensor.points_per_scan);
      CHECK(config.keyframe.scans == 10);
    }
    CHECK(paper_preset(sensor.kind).validate().ok());
    CHECK(paper_preset(sensor.kind).keyframe.max_points_per_scan >= sensor.points_per_scan);
  }
}

TEST_CASE("the paper's preset is the paper") {
  const PipelineConfig paper = paper_preset(SensorKind::kOs2_128);
  CHECK(paper.voxel.coarse_size_m == 2.0F);
  CHECK(paper.voxel.fine_size_m == 0.2F);
  CHECK(GroundConfig::kMaxTiltDeg == 30.0);
  CHECK(paper.ground.margin_m == 0.1F);
  CHECK(paper.removal.window == 10);
  CHECK(paper.removal.candidates_next_to_ground);
  CHECK(paper.free_space.columns);
  CHECK_FALSE(paper.free_space.visibility);
  CHECK(paper.removal.log_odds_free == paper.removal.log_odds_occupied);
  CHECK_FALSE(paper.removal.components);
}

TEST_CASE("an invalid configuration is refused with the reason") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto message = [](auto&& change) {
    PipelineConfig config = preset(SensorKind::kGeneric);
    change(config);
    const Error error = config.validate();
    CHECK(error.code == ErrorCode::kInvalidConfig);
    CHECK(Pipeline::required_bytes(config) == 0);
    alignas(64) std::byte few[64];
    CHECK(Pipeline::create(config, few).error().code == ErrorCode::kInvalidConfig);
    return std::string(error.message);
  };
  CHECK_THAT(message([](auto& c) { c.keyframe.scans = 0; }), StartsWith("keyframe.scans"));
  CHECK_THAT(message([](auto& c) { c.keyframe.scans = 33; }), Contains("[1, 32]"));
  CHECK_THAT(message([&](auto& c) { c.keyframe.distance_m = nan; }), Contains("distance_m"));
  CHECK_THAT(message([](auto& c) { c.keyframe.range_min_m = 200.0F; }), Contains("range_min_m"));
  CHECK_THAT(message([](auto& c) { c.voxel.coarse_size_m = 2.05F; }), Contains("whole multiple"));
  CHECK_THAT(message([](auto& c) { c.voxel.max_cells = 0; }), Contains("max_cells"));
  CHECK_THAT(message([](auto& c) { c.ground.margin_m = 2.0F; }), Contains("[-0.5, 1]"));
  CHECK_THAT(message([](auto& c) { c.free_space.visibility = false; }), Contains("must be true"));
  CHECK_THAT(message([](auto& c) { c.free_space.images_per_keyframe = 11; }),
             Contains("keyframe.scans"));
  CHECK_THAT(message([&](auto& c) { c.removal.log_odds_free = nan; }),
             Contains("removal.log_odds_free"));
  CHECK_THAT(message([](auto& c) { c.removal.window = 99; }), Contains("window"));
  CHECK_THAT(message([](auto& c) { c.voxel.max_window_blocks = c.voxel.max_blocks() - 1; }),
             Contains("max_window_blocks"));
  PipelineConfig least = preset(SensorKind::kGeneric);
  least.voxel.max_window_blocks = least.voxel.max_blocks();
  CHECK(least.validate().ok());
  CHECK_THAT(message([](auto& c) { c.loop_search.max_verified = 33; }), Contains("max_candidates"));
  CHECK_THAT(message([](auto& c) {
               c.descriptor.max_planes = 60000;
               c.loop_search.max_places = 100000;
             }),
             Contains("2^30"));
}

TEST_CASE("the required memory is exact") {
  const PipelineConfig config = small_config();
  const std::size_t bytes = Pipeline::required_bytes(config);
  const MemoryBlock block(bytes + 64);
  CHECK(Pipeline::create(config, {block.data(), bytes - 1}).error().code ==
        ErrorCode::kMemoryTooSmall);
  CHECK(Pipeline::create(config, {block.data() + 8, bytes}).error().code ==
        ErrorCode::kMemoryMisaligned);
  for (std::size_t i = 0; i < 64; ++i) block.data()[bytes + i] = std::byte{0xAB};
  auto created = Pipeline::create(config, {block.data(), bytes});
  REQUIRE(created.ok());
  Scene scene;
  const LabelledScan scan = scene.scan(sensor_at(0, 0), 0);
  for (int i = 1; i < 25; ++i) (void)(*created)->add_scan(scan.view(), sensor_at(0, 0), i);
  for (std::size_t i = 0; i < 64; ++i) CHECK(block.data()[bytes + i] == std::byte{0xAB});
}

TEST_CASE("every cause, stage and capacity has a name") {
  for (std::size_t i = 0; i < kDropCauses; ++i) {
    CHECK(drop_cause_name(static_cast<DropCause>(i)) != "unknown");
  }
  for (std::size_t i = 0; i < kStages; ++i) CHECK(stage_name(static_cast<Stage>(i)) != "unknown");
  for (std::size_t i = 0; i < kCapacities; ++i) {
    CHECK(capacity_name(static_cast<Capacity>(i)) != "unknown");
  }
}

TEST_CASE("stage times are taken with the caller's clock, or not at all") {
  PipelineConfig config = small_config();
  const Scene scene;
  const auto path = [](double) { return sensor_at(0, 0); };
  CHECK(run_scene(scene, config, 3, path).front().statistics.microseconds(Stage::kTotal) == 0.0F);
  config.clock_ns = [] {
    static std::int64_t now = 0;
    return now += 1000;
  };
  const auto statistics = run_scene(scene, config, 3, path).front().statistics;
  // Three scans, each between two readings of a clock that ticks with every look.
  CHECK(statistics.microseconds(Stage::kIngest) == Approx(3.0));
  CHECK(statistics.microseconds(Stage::kRemoval) == Approx(1.0));
  CHECK(statistics.microseconds(Stage::kTotal) > 10.0);
}
