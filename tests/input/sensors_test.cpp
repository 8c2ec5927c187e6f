// Tests of data sheets and of the recognition of sensors.
#include <algorithm>
#include <catch2/catch.hpp>
#include <fstream>
#include <limits>
#include <optional>

#include "src/input/recognition.hpp"
#include "src/input/sensor_sheets.hpp"
#include "tests/temporary_directory.hpp"
#include "unimapper/onboard/config.hpp"

using namespace unimapper;
using namespace unimapper::input;
using Catch::Matchers::Contains;

namespace {

/// What a spinning sensor with even rings sees of a hall around it.
datasets::Scan hall_scan(const SensorModel& model, std::uint32_t columns) {
  datasets::Scan scan;
  for (std::uint32_t c = 0; c < columns; ++c) {
    for (std::uint32_t ring = 0; ring < model.rings; ++ring) {
      const double azimuth = 2.0 * 3.14159265358979 * c / columns;
      const double share = static_cast<double>(ring) / (model.rings - 1);
      const double elevation = (static_cast<double>(model.elevation_min_deg) * (1.0 - share) +
                                static_cast<double>(model.elevation_max_deg) * share) /
                               kDegreesPerRadian;
      const Eigen::Vector3d d(std::cos(elevation) * std::cos(azimuth),
                              std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      const auto to_walls = [](double along, double low, double high) {
        return along > 0.0   ? high / along
               : along < 0.0 ? low / along
                             : std::numeric_limits<double>::infinity();
      };
      const double range =
          std::min({to_walls(d.x(), -14, 17), to_walls(d.y(), -9, 11), to_walls(d.z(), -1.7, 8)});
      const Eigen::Vector3f p = (range * d).cast<float>();
      scan.points.push_back({p.x(), p.y(), p.z(), 0.0F});
    }
  }
  return scan;
}

SensorFigures measured(const datasets::Scan& scan) {
  const std::vector<datasets::Scan> scans = {scan};
  return measure_sensor(scans, measure_directions(scans));
}

}  // namespace

TEST_CASE("every data sheet gives a preset that is valid") {
  CHECK(sensor_sheets().size() >= sensor_models().size() + 15);
  for (const SensorSheet& sheet : sensor_sheets()) {
    INFO(sheet.model.name);
    CHECK(sheet.model.validate().ok());
    CHECK(preset(sheet.model, Computer::kServer).ok());
    CHECK(find_sheet(sheet.model.name) == &sheet);
  }
}

TEST_CASE("sensors that no scan tells apart are recognised under the first name of the list") {
  const std::vector<SensorMatch> matches =
      match_sensors(measured(hall_scan(find_sheet("rs-16")->model, 1800)));
  CHECK(matches[0].sheet->model.name == "vlp-16");
  CHECK(is_recognised(matches));
}

TEST_CASE("sensors are found by any usual spelling, and typos get a suggestion") {
  for (const auto& [spelling, name] : {std::pair{"OS0-128", "os0-128"},
                                       {"ouster os1 32", "os1-32"},
                                       {"HDL32E", "hdl-32e"},
                                       {"VLP-32C", "vlp-32c"},
                                       {"Alpha Prime", "vls-128"},
                                       {"Pandar40P", "pandar-40p"},
                                       {"XT32", "xt-32"},
                                       {"QT64", "qt-64"},
                                       {"RS-Ruby", "rs-128"},
                                       {"Horizon", "livox-horizon"},
                                       {"HAP", "livox-hap"},
                                       {"velodyne", "vlp-16"},
                                       {"os2_128", "os2-128"}}) {
    INFO(spelling);
    REQUIRE(find_sheet(spelling) != nullptr);
    CHECK(find_sheet(spelling)->model.name == name);
  }
  CHECK(find_sheet("os9-64") == nullptr);
}

TEST_CASE("a data sheet of one's own is read, or refused with the member that is wrong") {
  const TemporaryDirectory folder;
  const auto file = folder.path() / "sheet.json";
  const auto write = [&](const std::string& text) { std::ofstream(file) << text; };
  const auto sheet_of = [](int rings, const std::string& more) {
    return R"({"name": "mine", "pattern": "spinning", "horizontal_fov_deg": 360,
      "elevation_deg": [-20, 12], "range_m": [0.5, 80], "columns": [900], "scan_rate_hz": 10,
      "rings": )" +
           std::to_string(rings) + more + "}";
  };
  write(sheet_of(24, ""));
  const SensorSheet sheet = read_sheet(file);
  CHECK(sheet.model.name == "mine");
  CHECK(sheet.model.points_per_scan == 21600);
  CHECK(preset(sheet.model, Computer::kServer).ok());
  CHECK_FALSE(sheet.T_base_lidar);
  write(sheet_of(24, R"(, "extrinsic": [0.5, 0, 2, 0, 0, 90])"));
  const std::optional<Pose> T_base_lidar = read_sheet(file).T_base_lidar;
  REQUIRE(T_base_lidar);
  CHECK((*T_base_lidar * Eigen::Vector3d::UnitX() - Eigen::Vector3d(0.5, 1, 2)).norm() < 1e-12);
  write(sheet_of(24, R"(, "extrinsic": [0.5, 0, 2])"));
  CHECK_THROWS_WITH(read_sheet(file), Contains("extrinsic: must be [x, y, z, roll, pitch, yaw]"));
  write(R"({"name": "mine", "pattern": "spinning"})");
  CHECK_THROWS_WITH(read_sheet(file), Contains("sheet.json") && Contains("horizontal_fov_deg"));
  write(R"({"name": "mine", "pattern": "sweeping"})");
  CHECK_THROWS_WITH(read_sheet(file), Contains("sheet.json: pattern: "));
  write(sheet_of(1, ""));
  CHECK_THROWS_WITH(read_sheet(file), Contains("sensor.rings"));
  write("[]");
  CHECK_THROWS_WITH(read_sheet(file), Contains("is not a JSON object"));
}

TEST_CASE("spinning sensors with even rings are recognised, or one just like them") {
  for (const SensorSheet& sheet : sensor_sheets()) {
    if (sheet.model.name == "generic" || sheet.model.pattern != ScanPattern::kSpinning) continue;
    if (sheet.ring_spacing_deg > 0.0) continue;
    // The usual mode and the coarsest: the points of the finest take long to make.
    const std::uint32_t coarsest = *std::min_element(sheet.columns.begin(), sheet.columns.end());
    for (const std::uint32_t columns : {std::min(sheet.columns.front(), 1024U), coarsest}) {
      if (columns != sheet.columns.front() && columns != coarsest) continue;
      const SensorFigures figures = measured(hall_scan(sheet.model, columns));
      const SensorMatch nearest = match_sensors(figures)[0];
      const double distance = match_sensor(figures, sheet).distance;
      INFO(sheet.model.name << " of " << columns << " columns: " << nearest.sheet->model.name << " "
                            << nearest.distance << ", itself " << distance);
      CHECK(nearest.sheet->model.rings == sheet.model.rings);
      CHECK(nearest.sheet->model.elevation_min_deg ==
            Approx(sheet.model.elevation_min_deg).margin(1.1));
      CHECK(distance < 0.8);
    }
  }
}

TEST_CASE("a sensor that publishes most points twice is recognised, each point counted once") {
  const datasets::Scan once = hall_scan(find_sheet("vlp-16")->model, 1800);
  datasets::Scan twice;
  for (std::size_t i = 0; i < once.points.size(); ++i) {
    twice.points.insert(twice.points.end(), 2, once.points[i]);
    twice.ring.insert(twice.ring.end(), 2, static_cast<std::uint16_t>(i % 16));
  }
  // Rays without a return are no copies of each other.
  twice.points.insert(twice.points.end(), 1000, {0.0F, 0.0F, 0.0F, 0.0F});
  twice.ring.insert(twice.ring.end(), 1000, 99);
  const SensorFigures figures = measured(twice);
  const SensorFigures expected = measured(once);
  CHECK(figures.copies == Approx(2.0));
  CHECK(expected.copies == Approx(1.0));
  CHECK(figures.points == expected.points);
  CHECK(figures.rings == 16);
  CHECK(figures.ray_spacing_deg == Approx(expected.ray_spacing_deg));
  CHECK(match_sensors(figures)[0].sheet == match_sensors(expected)[0].sheet);
}

TEST_CASE("a sensor named against what the points say is suspicious, one in another mode is not") {
  const SensorSheet& os1 = *find_sheet("os1-64");
  const SensorFigures figures = measured(hall_scan(os1.model, 512));
  CHECK(check_sensor(figures, os1).severity == Severity::kFine);
  const Finding named_wrongly = check_sensor(figures, *find_sheet("vlp-16"));
  CHECK(named_wrongly.severity == Severity::kSuspicious);
  CHECK_THAT(named_wrongly.message, Contains("--sensor os1-64"));
  CHECK(check_sensor(figures, *find_sheet("generic")).severity == Severity::kFine);
}

TEST_CASE("the generic model holds every point that was measured") {
  SensorModel odd = find_sheet("os1-64")->model;
  odd.rings = 120;
  odd.elevation_min_deg = -53.0F;
  odd.elevation_max_deg = 8.0F;
  const SensorModel model = generic_for(measured(hall_scan(odd, 1500)));
  CHECK(model.points_per_scan >= 120 * 1500);
  CHECK(model.elevation_min_deg <= -53.0F);
  CHECK(model.elevation_max_deg == sensor_model(SensorKind::kGeneric).elevation_max_deg);
  CHECK(preset(model, Computer::kServer).ok());
}
