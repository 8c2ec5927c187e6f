// Data sheets of LiDARs, from the onboard library, the tool's own list and files
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "unimapper/core/pose.hpp"
#include "unimapper/core/sensor.hpp"

namespace unimapper::input {

/// One LiDAR and the modes it has. `model.name` lives as long as the program.
struct SensorSheet {
  SensorModel model;                   ///< in its usual mode
  std::vector<std::uint32_t> columns;  ///< of its modes, the usual one first; empty: unknown
  /// Between neighbouring rings where most of them lie, degrees; 0: they are evenly spread.
  double ring_spacing_deg = 0.0;
  /// Where it is mounted on what the poses are of; a sheet of one's own may say so.
  std::optional<Pose> T_base_lidar{};
};

/// All sheets: those of the onboard library first, the generic one leading.
[[nodiscard]] const std::vector<SensorSheet>& sensor_sheets();

/// The names of all sheets.
[[nodiscard]] std::vector<std::string> sensor_names();

/// Finds a sheet by name, spelled as for `find_sensor`. Null if unknown.
[[nodiscard]] const SensorSheet* find_sheet(std::string_view name);

/// A sheet of one's own: an object like one of `sensors` in src/input/sensors.json. Throws
/// std::runtime_error naming `file` and the member that is missing or wrong.
[[nodiscard]] SensorSheet read_sheet(const std::filesystem::path& file);

}  // namespace unimapper::input
