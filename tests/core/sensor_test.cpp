// Tests of the sensor models.
#include "unimapper/core/sensor.hpp"

#include <catch2/catch.hpp>

using namespace unimapper;

TEST_CASE("a sensor is found however its name is spelt") {
  for (const char* name : {"OS2-128", "os2_128", "Ouster OS2-128", "os2 128"}) {
    const SensorModel* model = find_sensor(name);
    REQUIRE(model != nullptr);
    CHECK(model->kind == SensorKind::kOs2_128);
  }
  CHECK(find_sensor("Mid-360")->kind == SensorKind::kLivoxMid360);
  CHECK(find_sensor("no such lidar") == nullptr);
  CHECK(find_sensor("") == nullptr);
  CHECK(find_sensor("os2-1280") == nullptr);
}

TEST_CASE("every sensor model is listed under its own kind and canonical name") {
  for (const SensorModel& model : sensor_models()) {
    CHECK(&sensor_model(model.kind) == &model);
    CHECK(find_sensor(model.name) == &model);
    CHECK(model.elevation_min_deg < model.elevation_max_deg);
    CHECK(model.range_min_m < model.range_max_m);
  }
}
