// Tests of the sensor models.
#include "unimapper/core/sensor.hpp"

#include "tests/test.hpp"

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

TEST_CASE("every known sensor has a valid data sheet under its own kind and canonical name") {
  for (const SensorModel& model : sensor_models()) {
    INFO(model.name);
    CHECK(&sensor_model(model.kind) == &model);
    CHECK(find_sensor(model.name) == &model);
    CHECK(std::string(model.validate().message).empty());
  }
  CHECK_FALSE(SensorModel{}.validate().ok());
}

TEST_CASE("a figure that no LiDAR can have is refused by its name") {
  const auto complaint = [](auto change) {
    SensorModel model = sensor_model(SensorKind::kOs1_64);
    change(model);
    return std::string(model.validate().message);
  };
  using Catch::Contains;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  using Model = SensorModel&;
  CHECK_THAT(complaint([](Model m) { m.horizontal_fov_deg = 361; }),
             Contains("horizontal_fov_deg"));
  CHECK_THAT(complaint([](Model m) { m.elevation_max_deg = m.elevation_min_deg; }),
             Contains("elevation_min_deg"));
  CHECK_THAT(complaint([=](Model m) { m.elevation_min_deg = nan; }), Contains("elevation_min_deg"));
  CHECK_THAT(complaint([](Model m) { m.range_max_m = 501; }), Contains("range_max_m"));
  CHECK_THAT(complaint([](Model m) { m.range_min_m = m.range_max_m; }), Contains("range_min_m"));
  CHECK_THAT(complaint([](Model m) { m.rings = 1; }), Contains("rings"));
  for (const std::uint32_t points : {99U, 3300001U}) {
    CHECK_THAT(complaint([=](Model m) { m.points_per_scan = points; }),
               Contains("points_per_scan"));
  }
  CHECK_THAT(complaint([](Model m) { m.scan_rate_hz = 0; }), Contains("scan_rate_hz"));
  // A pattern that does not repeat has no rings.
  CHECK(complaint([](SensorModel& m) {
          m.pattern = ScanPattern::kNonRepetitive;
          m.rings = 0;
        }).empty());
}
