// Sensors of C programs: names, data sheets, and whether a configuration fits them.
#include <catch2/catch.hpp>
#include <cstring>
#include <string>

#include "ports/c/unimapper.h"
#include "unimapper/onboard/config.hpp"

using namespace unimapper;

TEST_CASE("sensors are found by name") {
  std::uint32_t sensor = 99;
  CHECK(um_sensor_find("Ouster OS2-128", &sensor) == UM_OK);
  CHECK(sensor == UM_SENSOR_OS2_128);
  CHECK(um_sensor_find("thermometer", &sensor) == UM_UNKNOWN_SENSOR);
  CHECK(sensor == UM_SENSOR_OS2_128);
  um_config config;
  CHECK(um_config_init(&config, sizeof config, 8) == UM_UNKNOWN_SENSOR);
}

namespace {

um_sensor_model data_sheet_of(SensorKind kind) {
  const SensorModel& known = sensor_model(kind);
  um_sensor_model model{};
  model.struct_size = sizeof model;
  model.pattern = static_cast<std::uint32_t>(known.pattern);
  model.horizontal_fov_deg = known.horizontal_fov_deg;
  model.elevation_min_deg = known.elevation_min_deg;
  model.elevation_max_deg = known.elevation_max_deg;
  model.range_min_m = known.range_min_m;
  model.range_max_m = known.range_max_m;
  model.rings = known.rings;
  model.points_per_scan = known.points_per_scan;
  model.scan_rate_hz = known.scan_rate_hz;
  return model;
}

}  // namespace

TEST_CASE("a known sensor's data sheet fills in what its name does") {
  for (const SensorModel& known : sensor_models()) {
    for (std::uint32_t computer = 0; computer <= UM_COMPUTER_ARMV7_WITH_64_MB; ++computer) {
      const um_sensor_model model = data_sheet_of(known.kind);
      um_config by_name{};
      um_config by_model{};
      const char* message = nullptr;
      REQUIRE(um_config_init_for(&by_name, sizeof by_name, static_cast<std::uint32_t>(known.kind),
                                 computer) == UM_OK);
      REQUIRE(um_config_from_model(&by_model, sizeof by_model, &model, computer, &message) ==
              UM_OK);
      CHECK(std::string(message).empty());
      CHECK(um_required_bytes(&by_model) == um_required_bytes(&by_name));
      for (const char* name :
           {"keyframe.range_min_m", "keyframe.range_max_m", "keyframe.max_points_per_scan",
            "free_space.horizontal_fov_deg", "free_space.elevation_min_deg",
            "free_space.elevation_max_deg", "free_space.elevation_resolution_deg",
            "free_space.images_per_keyframe", "ground.propagation_voxels"}) {
        char expected[32];
        char value[32];
        REQUIRE(um_config_get(&by_name, name, expected, sizeof expected) == UM_OK);
        REQUIRE(um_config_get(&by_model, name, value, sizeof value) == UM_OK);
        CHECK(std::string(value) == expected);
      }
    }
  }
}

TEST_CASE("a data sheet with a mistake is refused in words and writes nothing") {
  const char* message = nullptr;
  um_config config{};
  const um_config untouched = config;
  const auto status_of = [&](const um_sensor_model* model, std::uint32_t computer) {
    return um_config_from_model(&config, sizeof config, model, computer, &message);
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
  model.struct_size = 4;
  CHECK(status_of(&model, 0) == UM_UNKNOWN_VERSION);
  CHECK(std::memcmp(&config, &untouched, sizeof config) == 0);
  CHECK(um_config_from_model(nullptr, sizeof config, nullptr, 0, nullptr) == UM_NULL_ARGUMENT);
}

TEST_CASE("what a sensor needs is what C++ says, by name and by data sheet") {
  for (const SensorModel& known : sensor_models()) {
    for (std::uint32_t computer = 0; computer <= UM_COMPUTER_ARMV7_WITH_64_MB; ++computer) {
      const auto sensor = static_cast<std::uint32_t>(known.kind);
      um_config config;
      REQUIRE(um_config_init_for(&config, sizeof config, sensor, computer) == UM_OK);
      const SensorFit expected =
          sensor_fit(known, preset(known.kind, static_cast<Computer>(computer)));
      um_sensor_fit fit{};
      fit.struct_size = sizeof fit;
      REQUIRE(um_sensor_fit_get(&config, sensor, &fit) == UM_OK);
      CHECK(fit.struct_size == sizeof fit);
      CHECK(fit.fits == (expected.fits() ? 1 : 0));
      CHECK(fit.cells_needed == expected.cells_needed);
      CHECK(fit.cells == config.voxel_max_cells);
      CHECK(fit.range_m == expected.range_m);

      um_sensor_fit by_model{};
      by_model.struct_size = sizeof by_model;
      const um_sensor_model model = data_sheet_of(known.kind);
      const char* message = nullptr;
      REQUIRE(um_sensor_fit_from_model(&config, &model, &by_model, &message) == UM_OK);
      CHECK(std::string(message).empty());
      CHECK(std::memcmp(&by_model, &fit, sizeof fit) == 0);
    }
  }
}

TEST_CASE("fewer cells than a sensor needs do not fit it, a shorter range does") {
  um_config config;
  REQUIRE(um_config_init(&config, sizeof config, UM_SENSOR_OS2_128) == UM_OK);
  um_sensor_fit fit{};
  fit.struct_size = sizeof fit;
  REQUIRE(um_sensor_fit_get(&config, UM_SENSOR_OS2_128, &fit) == UM_OK);
  REQUIRE(fit.fits == 1);
  config.voxel_max_cells = fit.cells_needed - 1;
  REQUIRE(um_sensor_fit_get(&config, UM_SENSOR_OS2_128, &fit) == UM_OK);
  CHECK(fit.fits == 0);
  CHECK(fit.range_m < config.keyframe_range_max_m);
  config.keyframe_range_max_m = fit.range_m - 0.1F;
  REQUIRE(um_sensor_fit_get(&config, UM_SENSOR_OS2_128, &fit) == UM_OK);
  CHECK(fit.fits == 1);
}

TEST_CASE("what cannot be compared is refused and writes nothing") {
  um_config config;
  REQUIRE(um_config_init(&config, sizeof config, UM_SENSOR_VLP_16) == UM_OK);
  um_sensor_model model = data_sheet_of(SensorKind::kVlp16);
  um_sensor_fit fit{};
  fit.struct_size = sizeof fit;
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
  REQUIRE(um_config_init(&config, sizeof config, UM_SENSOR_VLP_16) == UM_OK);
  fit.struct_size = 4;
  CHECK(um_sensor_fit_get(&config, UM_SENSOR_VLP_16, &fit) == UM_UNKNOWN_VERSION);
}
