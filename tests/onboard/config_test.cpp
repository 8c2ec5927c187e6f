// Tests of the validation of parameters.
#include <catch2/catch.hpp>
#include <limits>
#include <string>

#include "run.hpp"

using namespace unimapper;
using namespace unimapper::test;

TEST_CASE("every sensor fits the memory of every computer") {
  struct Limit {
    Computer computer;
    std::size_t bytes;
  };
  for (const auto& [computer, bytes] :
       {Limit{Computer::kServer, 256'000'000}, Limit{Computer::kJetson, 192'000'000},
        Limit{Computer::kRaspberryPi, 96'000'000}, Limit{Computer::kArmv7With64Mb, 64'000'000}}) {
    for (const SensorKind sensor :
         {SensorKind::kOs2_128, SensorKind::kOs1_64, SensorKind::kHdl64e, SensorKind::kVlp16,
          SensorKind::kAevaAeries2, SensorKind::kLivoxAvia, SensorKind::kLivoxMid360}) {
      const PipelineConfig config = preset(sensor, computer);
      CAPTURE(static_cast<int>(sensor), static_cast<int>(computer));
      CHECK(config.validate().code == ErrorCode::kOk);
      CHECK(Pipeline::required_bytes(config) <= bytes);
    }
  }
}

TEST_CASE("every preset is valid, and fits the sensor's scans") {
  for (const SensorModel& sensor : sensor_models()) {
    INFO(sensor.name);
    for (const PipelineConfig& config : {preset(sensor.kind), paper_preset(sensor.kind)}) {
      CHECK(std::string(config.validate().message).empty());
      CHECK(config.keyframe.max_points_per_scan >= sensor.points_per_scan);
      CHECK(config.keyframe.scans == 10);
      CHECK(Pipeline::required_bytes(config) > 0);
    }
  }
  CHECK(preset(SensorKind::kOs2_128).keyframe.max_points_per_scan >= 131072);
}

TEST_CASE("thresholds are the same for all spinning sensors, and for all others") {
  const auto thresholds = [](PipelineConfig config) {
    return std::tuple(config.ground.margin_m, config.free_space.images_per_keyframe,
                      config.free_space.range_margin_m, config.ground.elevated_step_m,
                      GroundConfig::kElevatedReachM, config.ground.seen_through_share,
                      config.ground.propagation_voxels, config.removal.log_odds_free,
                      config.removal.log_odds_occupied, config.removal.component_dynamic_share,
                      config.removal.persistence_share);
  };
  for (const SensorModel& sensor : sensor_models()) {
    const SensorKind like =
        sensor.pattern == ScanPattern::kSpinning ? SensorKind::kHdl64e : SensorKind::kLivoxAvia;
    CHECK(thresholds(preset(sensor.kind)) == thresholds(preset(like)));
  }
}

TEST_CASE("pixels and the range of full certainty follow from how densely a sensor measures") {
  const auto free_space = [](SensorKind kind) { return preset(kind).free_space; };
  CHECK(free_space(SensorKind::kVlp16).elevation_resolution_deg == Approx(1.2F));
  CHECK(free_space(SensorKind::kOs2_128).elevation_resolution_deg == Approx(0.5F));
  CHECK(free_space(SensorKind::kLivoxMid360).azimuth_resolution_deg == Approx(1.0F).margin(0.1));
  CHECK(free_space(SensorKind::kLivoxAvia).azimuth_resolution_deg == Approx(0.47F).margin(0.05));
  // Two cells of 0.2 m between the rings of a VLP-16, 2 degrees apart.
  CHECK(free_space(SensorKind::kVlp16).full_weight_range_m == Approx(11.5F).margin(0.1));
  // One cell between the columns of an OS2, 0.35 degrees apart: wider than between its rings.
  CHECK(free_space(SensorKind::kOs2_128).full_weight_range_m == Approx(32.6F).margin(0.1));
}

TEST_CASE("the paper's preset is the paper") {
  const PipelineConfig paper = paper_preset(SensorKind::kOs2_128);
  CHECK(paper.voxel.coarse_size_m == 2.0F);
  CHECK(paper.voxel.fine_size_m == 0.2F);
  CHECK(paper.ground.max_tilt_deg == 30.0F);
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
  CHECK(message([](auto& c) { c.keyframe.scans = 0; }).find("keyframe.scans") == 0);
  CHECK(message([](auto& c) { c.keyframe.scans = 33; }).find("[1, 32]") != std::string::npos);
  CHECK(message([&](auto& c) { c.keyframe.distance_m = nan; }).find("distance_m") !=
        std::string::npos);
  CHECK(message([](auto& c) { c.keyframe.range_min_m = 200.0F; }).find("range_min_m") !=
        std::string::npos);
  CHECK(message([](auto& c) { c.voxel.coarse_size_m = 2.05F; }).find("whole multiple") !=
        std::string::npos);
  CHECK(message([](auto& c) { c.voxel.max_cells = 0; }).find("max_cells") != std::string::npos);
  CHECK(message([](auto& c) { c.ground.max_tilt_deg = 90.0F; }).find("[0.001, 80]") !=
        std::string::npos);
  CHECK(message([](auto& c) { c.free_space.visibility = false; }).find("must be true") !=
        std::string::npos);
  CHECK(message([](auto& c) { c.free_space.images_per_keyframe = 11; }).find("keyframe.scans") !=
        std::string::npos);
  CHECK(message([&](auto& c) { c.removal.log_odds_free = nan; }).find("removal.log_odds_free") !=
        std::string::npos);
  CHECK(message([](auto& c) { c.removal.window = 99; }).find("window") != std::string::npos);
  CHECK(message([](auto& c) {
          c.voxel.max_window_blocks = c.voxel.max_cells / 4 - 1;
        }).find("max_window_blocks") != std::string::npos);
  CHECK(message([](auto& c) { c.loop_search.max_verified = 33; }).find("max_candidates") !=
        std::string::npos);
  CHECK(message([](auto& c) {
          c.descriptor.max_planes = 60000;
          c.loop_search.max_places = 100000;
        }).find("2^30") != std::string::npos);
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

TEST_CASE("an OS2-128 keyframe of 131072 points per scan fits a robot's memory") {
  const std::size_t bytes = Pipeline::required_bytes(preset(SensorKind::kOs2_128));
  CHECK(bytes > 131072U * 10U * 4U);
  CHECK(bytes < 400U << 20U);
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
