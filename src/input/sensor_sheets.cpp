// Data sheets of LiDARs, from the onboard library, the tool's own list and files
#include "src/input/sensor_sheets.hpp"

#include <algorithm>
#include <cctype>
#include <deque>
#include <mutex>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "ports/datasets/files.hpp"
#include "src/input/extrinsic.hpp"

namespace unimapper::input {

/// The text of sensors.json, compiled in by CMake.
extern const char* const kSensorsJson;

namespace {

using Json = nlohmann::json;

/// Lower case letters and digits only.
std::string folded(std::string_view name) {
  std::string text;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) != 0) text += static_cast<char>(std::tolower(byte));
  }
  return text;
}

/// Names outlive every model that refers to them.
std::string_view kept(std::string name) {
  static std::mutex mutex;
  static std::deque<std::string> names;
  const std::lock_guard lock(mutex);
  return names.emplace_back(std::move(name));
}

ScanPattern parse_pattern(const std::string& name) {
  if (name == "spinning") return ScanPattern::kSpinning;
  if (name == "raster") return ScanPattern::kRaster;
  if (name == "non-repetitive") return ScanPattern::kNonRepetitive;
  throw std::runtime_error("pattern: must be spinning, raster or non-repetitive, not '" + name +
                           "'");
}

/// Throws nlohmann's exceptions or std::runtime_error.
SensorSheet parse_sheet(const Json& json) {
  SensorSheet sheet;
  SensorModel& model = sheet.model;
  model.kind = SensorKind::kGeneric;
  model.name = kept(json.at("name").get<std::string>());
  if (folded(model.name).empty()) throw std::runtime_error("name: must not be empty");
  model.pattern = parse_pattern(json.at("pattern").get<std::string>());
  model.horizontal_fov_deg = json.at("horizontal_fov_deg").get<float>();
  const auto elevation = json.at("elevation_deg").get<std::array<float, 2>>();
  model.elevation_min_deg = elevation[0];
  model.elevation_max_deg = elevation[1];
  const auto range = json.at("range_m").get<std::array<float, 2>>();
  model.range_min_m = range[0];
  model.range_max_m = range[1];
  model.scan_rate_hz = json.at("scan_rate_hz").get<float>();
  model.rings = json.value("rings", 0U);
  sheet.ring_spacing_deg = json.value("ring_spacing_deg", 0.0);
  sheet.columns = json.value("columns", std::vector<std::uint32_t>());
  if (json.contains("points_per_scan")) {
    model.points_per_scan = json.at("points_per_scan").get<std::uint32_t>();
  } else if (!sheet.columns.empty()) {
    model.points_per_scan = model.rings * sheet.columns.front();
  }
  if (json.contains("extrinsic")) {
    if (json.at("extrinsic").size() != 6) {
      throw std::runtime_error(
          "extrinsic: must be [x, y, z, roll, pitch, yaw], metres and degrees");
    }
    sheet.T_base_lidar = extrinsic_pose(json.at("extrinsic").get<std::array<double, 6>>());
  }
  const Error invalid = model.validate();
  if (!invalid.ok()) throw std::runtime_error(invalid.message);
  return sheet;
}

struct Sheets {
  std::vector<SensorSheet> sheets;
  std::vector<std::pair<std::string, std::size_t>> aliases;  // folded name, index
};

const Sheets& all() {
  static const Sheets kAll = [] {
    Sheets result;
    for (const SensorModel& model : sensor_models()) {
      SensorSheet sheet{model, {}};
      if (model.pattern == ScanPattern::kSpinning) {
        sheet.columns.push_back(model.points_per_scan / std::max(model.rings, 1U));
      }
      // Two blocks of rings, 1/3 and 1/2 degree apart.
      if (model.kind == SensorKind::kHdl64e) sheet.ring_spacing_deg = 0.375;
      if (model.name.starts_with("os")) sheet.columns = std::vector<std::uint32_t>{1024, 512, 2048};
      result.aliases.emplace_back(folded(model.name), result.sheets.size());
      result.sheets.push_back(std::move(sheet));
    }
    const Json sensors = Json::parse(kSensorsJson);
    for (const Json& json : sensors.at("sensors")) {
      const std::size_t index = result.sheets.size();
      result.sheets.push_back(parse_sheet(json));
      result.aliases.emplace_back(folded(result.sheets.back().model.name), index);
      const Json aliases = json.value("aliases", Json::array());
      for (const Json& alias : aliases) {
        result.aliases.emplace_back(folded(alias.get<std::string>()), index);
      }
    }
    return result;
  }();
  return kAll;
}

}  // namespace

const std::vector<SensorSheet>& sensor_sheets() { return all().sheets; }

std::vector<std::string> sensor_names() {
  std::vector<std::string> names;
  for (const SensorSheet& sheet : sensor_sheets()) names.emplace_back(sheet.model.name);
  return names;
}

const SensorSheet* find_sheet(std::string_view name) {
  if (const SensorModel* model = find_sensor(name)) {
    return &sensor_sheets()[static_cast<std::size_t>(model->kind)];
  }
  const std::string wanted = folded(name);
  for (const auto& [alias, index] : all().aliases) {
    if (alias == wanted) return &all().sheets[index];
  }
  return nullptr;
}

SensorSheet read_sheet(const std::filesystem::path& file) {
  const Json json = Json::parse(datasets::read_file(file), nullptr, false);
  if (!json.is_object()) throw std::runtime_error(file.string() + ": is not a JSON object");
  try {
    return parse_sheet(json);
  } catch (const Json::exception& error) {
    throw std::runtime_error(file.string() + ": " + error.what() +
                             "; a data sheet has name, pattern, horizontal_fov_deg, elevation_deg, "
                             "range_m, scan_rate_hz and rings with columns, or points_per_scan");
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(file.string() + ": " + error.what());
  }
}

}  // namespace unimapper::input
