// Tests of sensors of C programs: names, data sheets, and whether a configuration fits them.
#include "ports/c/unimapper.h"
#include "tests/test.hpp"
#include "unimapper/onboard/pipeline.hpp"

using namespace unimapper;

namespace {

um_sensor_model data_sheet_of(SensorKind kind) {
  const SensorModel& known = sensor_model(kind);
  return {static_cast<std::uint32_t>(known.pattern),
          known.horizontal_fov_deg,
          known.elevation_min_deg,
          known.elevation_max_deg,
          known.range_min_m,
          known.range_max_m,
          known.rings,
          known.points_per_scan,
          known.scan_rate_hz};
}

um_sensor_fit no_fit() {
  um_sensor_fit fit{};
  return fit;
}

}  // namespace

TEST_CASE("sensors are found by name") {
  std::uint32_t sensor = 99;
  CHECK(um_sensor_find("Ouster OS2-128", &sensor) == UM_OK);
  CHECK(sensor == UM_SENSOR_OS2_128);
  CHECK(um_sensor_find("thermometer", &sensor) == UM_UNKNOWN_SENSOR);
  CHECK(sensor == UM_SENSOR_OS2_128);
  CHECK(um_sensor_find(nullptr, nullptr) == UM_NULL_ARGUMENT);
}

TEST_CASE("a sensor's name and its data sheet give the preset of C++, its memory and its fit") {
  std::size_t handle = 0;
  int misfits = 0;
  for (const SensorModel& known : sensor_models()) {
    for (std::uint32_t computer = 0; computer <= UM_COMPUTER_ARMV7_WITH_64_MB; ++computer) {
      CAPTURE(known.kind, computer);
      const auto sensor = static_cast<std::uint32_t>(known.kind);
      const um_sensor_model model = data_sheet_of(known.kind);
      PipelineConfig expected = preset(known.kind, static_cast<Computer>(computer));
      um_config by_name{};
      um_config by_model{};
      const char* message = nullptr;
      REQUIRE(um_config_init_for(&by_name, sensor, computer) == UM_OK);
      REQUIRE(um_config_check(&by_name, nullptr) == UM_OK);
      REQUIRE(um_config_from_model(&by_model, &model, computer, &message) == UM_OK);
      CHECK(std::string(message).empty());
      const std::size_t core = Pipeline::required_bytes(expected);
      if (handle == 0) handle = um_required_bytes(&by_name) - core;
      CHECK(um_required_bytes(&by_name) == core + handle);
      CHECK(um_required_bytes(&by_model) == core + handle);
      for (const char* name :
           {"keyframe.range_min_m", "keyframe.range_max_m", "keyframe.max_points_per_scan",
            "free_space.horizontal_fov_deg", "free_space.elevation_min_deg",
            "free_space.elevation_max_deg", "free_space.elevation_resolution_deg",
            "free_space.images_per_keyframe", "ground.propagation_voxels"}) {
        char of_name[32];
        char of_model[32];
        REQUIRE(um_config_get(&by_name, name, of_name, sizeof of_name) == UM_OK);
        REQUIRE(um_config_get(&by_model, name, of_model, sizeof of_model) == UM_OK);
        CHECK(std::string(of_model) == of_name);
      }
      // As it is, and with fewer cells.
      for (const std::uint32_t fewer : {1U, 4U}) {
        by_name.voxel_max_cells /= fewer;
        expected.voxel.max_cells = by_name.voxel_max_cells;
        const SensorFit cpp = sensor_fit(known, expected);
        misfits += cpp.fits() ? 0 : 1;
        um_sensor_fit fit = no_fit();
        um_sensor_fit fit_by_model = no_fit();
        REQUIRE(um_sensor_fit_get(&by_name, sensor, &fit) == UM_OK);
        CHECK(fit.fits == (cpp.fits() ? 1 : 0));
        CHECK(fit.cells_needed == cpp.cells_needed);
        CHECK(fit.cells == by_name.voxel_max_cells);
        CHECK(fit.range_m == cpp.range_m);
        REQUIRE(um_sensor_fit_from_model(&by_name, &model, &fit_by_model, &message) == UM_OK);
        CHECK(std::string(message).empty());
        CHECK(std::memcmp(&fit_by_model, &fit, sizeof fit) == 0);
      }
    }
  }
  CHECK(misfits > 0);
  // Room for 256 loops, the most that a search may be configured to give, and for the scans of the
  // keyframe closed last and of the one finished last.
  CHECK(handle < 256 * sizeof(um_loop) + 2 * UM_MAX_SCANS * sizeof(um_scan) + 4096);
  um_config config;
  REQUIRE(um_config_init_for(&config, UM_SENSOR_OS2_128, UM_COMPUTER_ARMV7_WITH_64_MB) == UM_OK);
  CHECK(um_required_bytes(&config) <= 64'000'000);
  CHECK(um_config_init(&config, 8) == UM_UNKNOWN_SENSOR);
  CHECK(um_config_init_for(&config, 0, 4) == UM_UNKNOWN_COMPUTER);
}

TEST_CASE("a data sheet with a mistake is refused in words and writes nothing") {
  const char* message = nullptr;
  um_config config{};
  const um_config untouched = config;
  const auto status_of = [&](const um_sensor_model* model, std::uint32_t computer) {
    return um_config_from_model(&config, model, computer, &message);
  };
  um_sensor_model model = data_sheet_of(SensorKind::kOs1_64);
  CHECK(status_of(nullptr, 0) == UM_NULL_ARGUMENT);
  CHECK(status_of(&model, 99) == UM_UNKNOWN_COMPUTER);
  model.rings = 0;
  CHECK(status_of(&model, 0) == UM_INVALID_CONFIG);
  CHECK_THAT(std::string(message), Catch::Contains("rings"));
  model.pattern = 3;
  CHECK(status_of(&model, 0) == UM_INVALID_CONFIG);
  CHECK_THAT(std::string(message), Catch::Contains("pattern"));
  model = data_sheet_of(SensorKind::kOs1_64);
  CHECK(std::memcmp(&config, &untouched, sizeof config) == 0);
  CHECK(um_config_from_model(nullptr, nullptr, 0, nullptr) == UM_NULL_ARGUMENT);
}

TEST_CASE("what cannot be compared is refused and writes nothing") {
  um_config config;
  REQUIRE(um_config_init(&config, UM_SENSOR_VLP_16) == UM_OK);
  um_sensor_model model = data_sheet_of(SensorKind::kVlp16);
  um_sensor_fit fit = no_fit();
  const um_sensor_fit untouched = fit;
  const char* message = nullptr;
  CHECK(um_sensor_fit_get(&config, UM_SENSOR_VLP_16, nullptr) == UM_NULL_ARGUMENT);
  CHECK(um_sensor_fit_get(nullptr, UM_SENSOR_VLP_16, &fit) == UM_NULL_ARGUMENT);
  CHECK(um_sensor_fit_get(&config, 99, &fit) == UM_UNKNOWN_SENSOR);
  CHECK(um_sensor_fit_from_model(&config, nullptr, &fit, nullptr) == UM_NULL_ARGUMENT);
  model.rings = 0;
  CHECK(um_sensor_fit_from_model(&config, &model, &fit, &message) == UM_INVALID_CONFIG);
  CHECK_THAT(std::string(message), Catch::Contains("rings"));
  config.voxel_max_cells = 0;
  CHECK(um_sensor_fit_get(&config, UM_SENSOR_VLP_16, &fit) == UM_INVALID_CONFIG);
  CHECK(std::memcmp(&fit, &untouched, sizeof fit) == 0);
  REQUIRE(um_config_init(&config, UM_SENSOR_VLP_16) == UM_OK);
}
