// Presets from a sensor's data sheet.
#include "tests/random.hpp"
#include "tests/test.hpp"
#include "unimapper/core/parameter_table.hpp"
#include "unimapper/onboard/config.hpp"
#include "unimapper/onboard/owned_pipeline.hpp"

using namespace unimapper;

namespace {

bool same(const PipelineConfig& a, const PipelineConfig& b) {
  const std::span<const Parameter> all = kCheckedParameters<PipelineConfig>;
  return std::all_of(all.begin(), all.end(), [&](const Parameter& parameter) {
    return value_of(parameter, &a) == value_of(parameter, &b);
  });
}

constexpr Computer kComputers[] = {Computer::kServer, Computer::kJetson, Computer::kRaspberryPi,
                                   Computer::kArmv7With64Mb};

}  // namespace

TEST_CASE("a known sensor's data sheet gives the preset of its kind, on every computer") {
  for (const SensorModel& model : sensor_models()) {
    for (const Computer computer : kComputers) {
      CAPTURE(std::string(model.name), static_cast<int>(computer));
      const Expected<PipelineConfig> config = preset(model, computer);
      REQUIRE(config.ok());
      CHECK(same(*config, preset(model.kind, computer)));
    }
  }
}

TEST_CASE("a mode with more columns gets the room it needs") {
  const PipelineConfig own = preset(SensorKind::kOs2_128);
  CHECK(same(preset(SensorKind::kOs2_128, Computer::kServer, 0), own));
  CHECK(same(preset(SensorKind::kOs2_128, Computer::kServer, 1024), own));
  const PipelineConfig twice = preset(SensorKind::kOs2_128, Computer::kServer, 2048);
  CHECK(twice.keyframe.max_points_per_scan >= 2048 * 128);
  CHECK(twice.voxel.max_cells == 2 * own.voxel.max_cells);
  CHECK(twice.voxel.max_window_blocks == 2 * own.voxel.max_window_blocks);
  CHECK(twice.free_space.ray_spacing_deg == Approx(360.0 / 2048));
  CHECK(preset(SensorKind::kOs2_128, Computer::kJetson, 2048).voxel.max_cells ==
        preset(SensorKind::kOs2_128, Computer::kJetson).voxel.max_cells);
  for (const Computer computer : kComputers) {
    CHECK(preset(SensorKind::kOs2_128, computer, 2048).validate().ok());
    CHECK(preset(SensorKind::kOs2_128, computer, 4000000000U).validate().ok());
  }
  // Without columns there is no such mode.
  CHECK(same(preset(SensorKind::kLivoxMid360, Computer::kServer, 2048),
             preset(SensorKind::kLivoxMid360)));
}

TEST_CASE("a data sheet with a mistake is refused in words, up to the owning pipeline") {
  SensorModel model = sensor_model(SensorKind::kVlp16);
  model.range_max_m = 0.0F;
  const Expected<PipelineConfig> config = preset(model);
  REQUIRE_FALSE(config.ok());
  CHECK(config.error().code == ErrorCode::kInvalidConfig);
  CHECK_THAT(std::string(config.error().message), Catch::Contains("range_max_m"));
  OwnedPipeline pipeline(config);
  CHECK_FALSE(pipeline.ok());
  CHECK(pipeline.bytes() == 0);
  CHECK(std::string(pipeline.error().message) == config.error().message);
}

TEST_CASE("every valid data sheet gives a valid configuration") {
  test::Random random(7);
  const auto whole = [&](double low, double high) {
    return static_cast<std::uint32_t>(random.uniform(low, high));
  };
  const auto real = [&](double low, double high) {
    return static_cast<float>(random.uniform(low, high));
  };
  for (int i = 0; i < 2000; ++i) {
    SensorModel model;
    model.pattern = static_cast<ScanPattern>(whole(0, 3));
    model.horizontal_fov_deg = i % 7 == 0 ? 360.0F : real(10, 360);
    model.elevation_min_deg = i % 5 == 0 ? -90.0F : real(-90, 88);
    model.elevation_max_deg = i % 11 == 0 ? 90.0F : real(model.elevation_min_deg + 1.01, 90);
    model.range_min_m = real(0, 5);
    model.range_max_m = real(model.range_min_m + 0.1, 500);
    model.rings = i % 3 == 0 ? 2 : whole(2, 1025);
    model.points_per_scan = i % 13 == 0 ? 3300000 : whole(100, 300000);
    model.scan_rate_hz = real(1, 100);
    REQUIRE(std::string(model.validate().message).empty());
    for (const Computer computer : kComputers) {
      const Expected<PipelineConfig> config = preset(model, computer);
      CAPTURE(i, config.error().message);
      REQUIRE(config.ok());
    }
  }
}

TEST_CASE(
    "the cells a sensor needs are those of the densest simulated town, a third more at most") {
  struct Measured {
    SensorKind sensor;
    float range_m;
    std::uint32_t cells;
  };
  constexpr Measured kDenserTown[] = {
      {SensorKind::kHdl64e, 40.0F, 99269},        {SensorKind::kHdl64e, 60.0F, 135583},
      {SensorKind::kHdl64e, 120.0F, 182218},      {SensorKind::kVlp16, 40.0F, 57311},
      {SensorKind::kVlp16, 60.0F, 70871},         {SensorKind::kVlp16, 100.0F, 80816},
      {SensorKind::kOs1_64, 40.0F, 94865},        {SensorKind::kOs1_64, 60.0F, 116447},
      {SensorKind::kOs1_64, 120.0F, 131146},      {SensorKind::kOs2_128, 40.0F, 156604},
      {SensorKind::kOs2_128, 60.0F, 224488},      {SensorKind::kOs2_128, 240.0F, 352147},
      {SensorKind::kAevaAeries2, 40.0F, 61303},   {SensorKind::kAevaAeries2, 60.0F, 96764},
      {SensorKind::kAevaAeries2, 400.0F, 171880}, {SensorKind::kLivoxAvia, 40.0F, 31807},
      {SensorKind::kLivoxAvia, 60.0F, 44028},     {SensorKind::kLivoxAvia, 450.0F, 56473},
      {SensorKind::kLivoxMid360, 40.0F, 47895},   {SensorKind::kLivoxMid360, 60.0F, 51990},
      {SensorKind::kLivoxMid360, 70.0F, 52859}};
  for (const Measured& measured : kDenserTown) {
    const SensorModel& model = sensor_model(measured.sensor);
    CAPTURE(std::string(model.name), measured.range_m);
    PipelineConfig config = preset(measured.sensor);
    config.keyframe.range_max_m = measured.range_m;
    const double needed = sensor_fit(model, config).cells_needed;
    CHECK(needed > 0.98 * measured.cells);
    CHECK(needed < 1.33 * measured.cells);
    // Half of the cells do not fit, and the range that is proposed needs just so many.
    config.voxel.max_cells = measured.cells / 2;
    const SensorFit fit = sensor_fit(model, config);
    REQUIRE_FALSE(fit.fits());
    config.keyframe.range_max_m = fit.range_m;
    CHECK(std::abs(sensor_fit(model, config).cells_needed - 0.5 * measured.cells) < 2.0);
  }
}

TEST_CASE("what a sensor needs is compared with the cells of a computer, and which range fits") {
  const SensorModel& os2 = sensor_model(SensorKind::kOs2_128);
  for (const SensorModel& model : sensor_models()) {
    CAPTURE(std::string(model.name));
    CHECK(sensor_fit(model, preset(model.kind)).fits());
    CHECK(sensor_fit(model, preset(model.kind, Computer::kRaspberryPi)).fits());
  }
  PipelineConfig config = preset(os2, Computer::kArmv7With64Mb).value();
  const SensorFit fit = sensor_fit(os2, config);
  CHECK_FALSE(fit.fits());
  CHECK(fit.cells == config.voxel.max_cells);
  // A dense street occupied 151 720 cells within 40 m.
  CHECK(fit.cells_needed > 151720);
  CHECK(fit.cells_needed < 170000);
  CHECK(fit.range_m < config.keyframe.range_max_m);

  // What is proposed helps: the range, or the cells, or larger ones.
  config.keyframe.range_max_m = fit.range_m - 0.1F;
  CHECK(sensor_fit(os2, config).fits());
  config = preset(os2, Computer::kArmv7With64Mb).value();
  config.voxel.max_cells = fit.cells_needed;
  CHECK(sensor_fit(os2, config).fits());
  CHECK(sensor_fit(os2, config).range_m == config.keyframe.range_max_m);
  config.voxel.max_cells = fit.cells_needed - 1;
  CHECK_FALSE(sensor_fit(os2, config).fits());
  config = preset(os2, Computer::kArmv7With64Mb).value();
  config.voxel.fine_size_m = 0.25F;
  CHECK(sensor_fit(os2, config).fits());
}

TEST_CASE("an owning pipeline takes exactly what the pipeline needs, once") {
  PipelineConfig config = preset(SensorKind::kVlp16, Computer::kArmv7With64Mb);
  OwnedPipeline pipeline(config);
  REQUIRE(pipeline.ok());
  CHECK(pipeline.bytes() == Pipeline::required_bytes(config));
  CHECK(pipeline->config().loop_search.max_places == config.loop_search.max_places);
  CHECK((*pipeline).keyframe().static_cells.empty());
}

TEST_CASE("pixels and the range of full weight follow from how densely a sensor measures") {
  const auto free_space = [](SensorKind kind) { return preset(kind).free_space; };
  // Pixels of spinning sensors span the gaps between rays.
  const FreeSpaceConfig vlp = free_space(SensorKind::kVlp16);
  CHECK(vlp.elevation_resolution_deg == Approx(0.6 * 2.0));
  CHECK(vlp.azimuth_resolution_deg == Approx(0.4));
  CHECK(vlp.full_weight_range_m == Approx(0.4 / 2.0 * 57.2958).epsilon(1e-4));
  CHECK(free_space(SensorKind::kOs2_128).elevation_resolution_deg == Approx(0.5F));
  // One cell between the columns of an OS2, 0.35 degrees apart: wider than between its rings.
  CHECK(free_space(SensorKind::kOs2_128).full_weight_range_m == Approx(32.6F).margin(0.1));
  CHECK(free_space(SensorKind::kLivoxMid360).azimuth_resolution_deg == Approx(1.0F).margin(0.1));
  CHECK(free_space(SensorKind::kLivoxAvia).azimuth_resolution_deg == Approx(0.47F).margin(0.05));

  // 512 columns: rays of a ring are farther apart than its rings.
  SensorModel half = sensor_model(SensorKind::kOs2_128);
  half.points_per_scan = 512 * half.rings;
  const FreeSpaceConfig os2 = preset(half).value().free_space;
  CHECK(os2.azimuth_resolution_deg == Approx(0.85 * 360.0 / 512.0));
  CHECK(os2.full_weight_range_m == Approx(0.2 / (360.0 / 512.0) * 57.2958).epsilon(1e-4));
}
