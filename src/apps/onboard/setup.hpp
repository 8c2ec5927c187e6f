// Choice of sensor and parameters of a run.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "ports/datasets/dataset.hpp"
#include "src/apps/onboard/options.hpp"
#include "unimapper/core/sensor.hpp"
#include "unimapper/onboard/config.hpp"

namespace unimapper::apps {

/// A LiDAR and where its name was found.
struct ChosenSensor {
  const SensorModel* model = nullptr;
  std::string source;  ///< for the user, e.g. "--sensor"
};

/// The LiDAR that DATASET/dataset.json names ({"sensor": "os2-128"}); empty where the file or
/// the entry is not there. Throws std::runtime_error for a damaged file.
std::optional<std::string> recorded_sensor(const std::filesystem::path& dataset);

/// The LiDAR named by --sensor, else by dataset.json, else implied by the format (`implied`),
/// else the generic one. Throws std::runtime_error for an unknown name.
ChosenSensor choose_sensor(const OnboardOptions& options, const std::string& implied);

/// The setting for indoors or outdoors, and where it was found.
struct ChosenSurroundings {
  Surroundings surroundings = Surroundings::kOutdoors;
  std::string source;            ///< for the user, e.g. "--surroundings"
  float extent_m = 0.0F;         ///< as in `SurroundingsEstimate`; 0: nothing was measured
  float scan_interval_s = 0.1F;  ///< between the first scans
};

/// The name of surroundings: "indoors" or "outdoors".
[[nodiscard]] std::string_view surroundings_name(Surroundings surroundings);

/// The surroundings named by --surroundings, else as the first scans of `dataset` say. The paper's
/// preset knows outdoors only.
ChosenSurroundings choose_surroundings(const OnboardOptions& options,
                                       const datasets::Dataset& dataset);

/// The chosen preset for the surroundings and for the sensor in a mode of `columns` columns (0: as
/// its data sheet says), with the configuration file on top. Throws std::runtime_error for an
/// unknown preset or a wrong file.
PipelineConfig make_config(const OnboardOptions& options, SensorKind sensor,
                           const ChosenSurroundings& surroundings, std::uint32_t columns);

}  // namespace unimapper::apps
